"""Surfaces of a tree: one closed, tapered tube per branch. The one source of triangles.

Pictures, mesh files, CityJSON and the simulated scanner all draw what `tubes` makes.
"""

from pipeline.mesh.surface import Mesh, TubeOptions, tubes

__all__ = ["Mesh", "TubeOptions", "tubes"]
