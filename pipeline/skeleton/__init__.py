"""Skeleton extraction: one file a method, all with the same face.

================== ===================================================================================
method             how it works, and what it is good at
================== ===================================================================================
geodesic           thick limbs by cylinders, the rest by slices of equal distance; the most exact on
                   dense clouds
greedy             the stem by circles, the rest point by point; finds twice as much of a tree scanned
                   from the air
mst                the papers' method, a spanning tree over centred points; branch orders often fail
space-colonization the stem as greedy, then growth into the points, which uses them up; finds two thirds
                   of what greedy finds of a leafless tree scanned from the air
minimal-length     the shortest straight branches at given angles that reach the crown's points; plausible
                   branches where little but leaves is seen, not those that are there
================== ===================================================================================

`auto` takes geodesic where neighbouring points lie within 4.5 cm of each other (7 cm, if they are evenly
thinned), else greedy. docs/skeleton-methods.md holds all of them against known trees.
"""

from pipeline.skeleton.extraction import METHODS, SkeletonOptions, extract

__all__ = ["METHODS", "SkeletonOptions", "extract"]
