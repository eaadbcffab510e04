"""Skeleton extraction: one file a method, all with the same face.

======== ==========================================================================================
method   what it is good at
======== ==========================================================================================
mst      the papers' method: a spanning tree over centred points; every dense leafless cloud
======== ==========================================================================================
"""

from pipeline.skeleton.extraction import METHODS, SkeletonOptions, extract

__all__ = ["METHODS", "SkeletonOptions", "extract"]
