"""Skeleton extraction: one file a method, all with the same face.

======== =============================================================================================
method   how it works, and what it is good at
======== =============================================================================================
mst      the papers' method, a spanning tree over centred points; holds up best where points are sparse
geodesic thick limbs by cylinders, the rest by slices of equal distance; more exact on dense clouds, and
         its branch orders are right far more often
======== =============================================================================================

`auto` takes geodesic where neighbouring points lie within 7 cm of each other, else mst.
"""

from pipeline.skeleton.extraction import METHODS, SkeletonOptions, extract

__all__ = ["METHODS", "SkeletonOptions", "extract"]
