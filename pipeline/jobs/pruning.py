"""One operation on a tree that was read: as metamers, and back."""

from __future__ import annotations

from pipeline.growth import GrowthOptions
from pipeline.growth.carrying import Carrying
from pipeline.growth.pruning import Operation, Pruned
from pipeline.model import TreeModel


def prune(
    tree: TreeModel, operation: Operation, options: GrowthOptions, *, seed: int = 0
) -> tuple[TreeModel, Pruned]:
    """Return a tree after an operation, and what that did.

    Nodes and radii of wood that stays are those of `tree`, to the last bit; only what has been bent moves. A
    node is added where a cut falls between two.

    Parameters
    ----------
    tree : TreeModel
    operation : Operation
    options : GrowthOptions
        The length of metamers, and where their buds are.
    seed : int
        Turns the buds that a scan does not show.

    Raises
    ------
    ModelError
        If the tree has no radii.
    UsageError
        If a branch is not there, or nothing would be left.
    """
    growth = Carrying(tree, options, seed=seed)
    done = operation.apply(growth)
    return growth.to_model({"operation": operation.name}), done
