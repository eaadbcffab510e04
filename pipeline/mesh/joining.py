"""`union`: the tubes of a tree as one closed surface, where branches grow out of each other."""

from __future__ import annotations

from dataclasses import replace
from importlib import import_module
from typing import Any

import numpy as np

from pipeline.errors import MissingExtraError, ModelError
from pipeline.mesh.building import build
from pipeline.mesh.options import MeshOptions
from pipeline.mesh.triangles import Mesh, together
from pipeline.model import Floats, Ints, TreeModel


def union(source: TreeModel | Mesh, *, options: MeshOptions | None = None) -> Mesh:
    """Join the tubes of all branches into one closed surface without anything inside.

    Whole tubes are joined, not their segments, in one pass over all of them.

    Parameters
    ----------
    source : TreeModel or Mesh
        A tree is drawn first. Leaves are not joined; they follow the bark as they are.
    options : MeshOptions, optional
        How a tree is drawn; a mesh is taken as it is.

    Returns
    -------
    Mesh
        The bark is closed and counts no volume twice; every face still says which branch it is of. It has no
        normals.

    Raises
    ------
    MissingExtraError
        If manifold3d is not installed.
    ModelError
        If a tube is not closed.

    Notes
    -----
    `Mesh.branch_volume` sums to the volume of the union; what it says of one branch means nothing, for
    its surface is open. Branches that do not touch stay apart: there are then several closed surfaces.
    """
    manifold = _manifold()
    mesh = source if isinstance(source, Mesh) else build(source, options=options)
    bark, leaves = mesh.only(~mesh.leaf), mesh.only(mesh.leaf)
    order = np.argsort(bark.branch, kind="stable")
    numbers, starts = np.unique(bark.branch[order], return_index=True)
    tubes = np.split(bark.faces[order], starts[1:]) if len(starts) else []
    parts = [
        _solid(manifold, bark.vertices, faces, branch)
        for branch, faces in zip(numbers.tolist(), tubes, strict=True)
    ]
    owner = {part.original_id(): branch for part, branch in zip(parts, numbers.tolist(), strict=True)}
    joined = manifold.Manifold.batch_boolean(parts, manifold.OpType.Add).to_mesh64()
    size = np.diff(joined.run_index) // 3
    branch = np.repeat([owner[number] for number in joined.run_original_id], size)
    bare = replace(
        bark,
        vertices=joined.vert_properties,
        faces=joined.tri_verts,
        branch=branch,
        leaf=np.zeros(len(branch), dtype=bool),
        normals=None,
        uv=None,
    )
    return together(bare, leaves)


def _manifold() -> Any:
    """Return the library that joins solids."""
    try:
        return import_module("manifold3d")
    except ModuleNotFoundError as error:
        msg = "joining branches needs manifold3d; install it with `pip install 'treepipe[mesh]'`"
        raise MissingExtraError(msg) from error


def _solid(manifold: Any, vertices: Floats, faces: Ints, branch: int) -> Any:
    """Return the tube of one branch as a solid that remembers where it comes from."""
    used, corner = np.unique(faces, return_inverse=True)
    made = manifold.Manifold(manifold.Mesh64(vertices[used], corner.reshape(-1, 3).astype(np.uint64)))
    if made.status() != manifold.Error.NoError:
        why = made.status().name
        msg = f"the tube of branch {branch} is not closed ({why}); join what `tubes` or `build` draws"
        raise ModelError(msg)
    return made.as_original()
