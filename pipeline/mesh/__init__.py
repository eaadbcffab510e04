"""Surfaces of a tree: one closed, tapered tube per branch. The one source of triangles.

Pictures, mesh files, CityJSON and the simulated scanner all draw what `tubes` makes. `build` adds what
mesh files may want: rounded bends, leaves, less detail; `union` joins the tubes into one surface.

| file | what |
|---|---|
| `axes`, `surface` | the axes of a tree, all in one set of arrays, and a tube around each |
| `tube`, `rings`, `touching`, `vector` | proper tubes; compiled |
| `wrapping` | where they lie in a picture of bark |
| `smoothing` | rounded bends |
| `detail` | levels of detail with one silhouette |
| `foliage` | leaves at the tips |
| `building` | all of these by option |
| `joining` | the union of the tubes |
| `triangles`, `options` | what comes out, and what can be chosen |
"""

from pipeline.mesh.building import build
from pipeline.mesh.joining import union
from pipeline.mesh.options import MeshOptions, TubeOptions
from pipeline.mesh.surface import tubes
from pipeline.mesh.triangles import Mesh

__all__ = ["Mesh", "MeshOptions", "TubeOptions", "build", "tubes", "union"]
