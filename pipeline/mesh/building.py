"""`build`: the mesh of a tree as mesh files may want it."""

from __future__ import annotations

import numpy as np

from pipeline.mesh.axes import Axes
from pipeline.mesh.detail import coarser, reduced, spikes
from pipeline.mesh.foliage import foliage
from pipeline.mesh.options import MeshOptions
from pipeline.mesh.smoothing import smoothed
from pipeline.mesh.surface import axes_of, drawn, settle
from pipeline.mesh.triangles import Flags, Mesh, together, with_normals
from pipeline.model import TreeModel


def build(tree: TreeModel, *, options: MeshOptions | None = None) -> Mesh:
    """Draw a tree with rounded bends, leaves or less detail, as the options say.

    Parameters
    ----------
    tree : TreeModel
    options : MeshOptions, optional
        As they stand, what comes out is that of `tubes`.

    Returns
    -------
    Mesh
        Bark first, tube after tube, each closed; then the leaves, open and to be seen from both
        sides. With normals where `smooth` is set.
    """
    options = options or MeshOptions()
    bark, flat = wood(tree, options) if options.lod else finest(tree, options)
    if options.smooth:
        bark = with_normals(bark, flat)
    if options.leaves == "none":
        return bark
    leaves = foliage(tree, options)
    return together(bark, with_normals(leaves, ~leaves.leaf) if options.smooth else leaves)


def finest(tree: TreeModel, options: MeshOptions) -> tuple[Mesh, Flags]:
    """Draw the bark with every node, and say which faces close the end of a tube."""
    axes = axes_of(tree, options)
    if options.smooth:
        axes = smoothed(settled(axes, options), options)
    return drawn(axes, tree.skeleton, options)


def settled(axes: Axes, options: MeshOptions) -> Axes:
    """Return the axes with those nodes alone that carry a ring, without the axes that draw nothing."""
    _, made = settle(axes, options)
    carries = np.zeros(len(axes.points), dtype=bool)
    carries[made.kept] = True
    return axes.only(carries)


def wood(tree: TreeModel, options: MeshOptions) -> tuple[Mesh, Flags]:
    """Draw the bark with a quarter of the triangles for every level of detail."""
    full, _ = finest(tree, options)
    coarse = coarser(options)
    most = len(full.faces) // 4**options.lod
    axes, thin = reduced(tree, axes_of(tree, options), coarse, most)
    bark, flat = drawn(axes, tree.skeleton, coarse)
    sharp = spikes(thin, tree.skeleton)
    return together(bark, sharp), np.concatenate([flat, np.arange(len(sharp.faces)) % 4 == 3])
