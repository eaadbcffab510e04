"""How the cost of work follows the size of what it works on: two costs of one run, never seconds."""

from __future__ import annotations

import gc
from collections.abc import Callable
from time import process_time
from typing import TypeVar

from pipeline.model import Skeleton, TreeModel

Input = TypeVar("Input")


def slowdown(work: Callable[[Input], object], small: Input, large: Input, repeats: int = 3) -> float:
    """Return how many times the processor time of `work(small)` it takes to `work(large)`.

    The best of some calls each, in turns, so that a busy machine slows both down; a first call, to compile,
    does not count. The collector of garbage rests meanwhile: it walks whatever else the session holds.
    Choose a small input that takes 20 ms or more. Of four times the input, work in proportion to it costs
    about 4 times as much and quadratic work 16 times: ask for less than 12.
    """
    work(small)
    resting = gc.isenabled()
    gc.disable()
    try:
        costs = [(_cost(work, small), _cost(work, large)) for _ in range(repeats)]
    finally:
        if resting:
            gc.enable()
    return min(large for _, large in costs) / min(small for small, _ in costs)


def _cost(work: Callable[[Input], object], thing: Input) -> float:
    begin = process_time()
    work(thing)
    return process_time() - begin


def first_nodes(tree: TreeModel, count: int) -> TreeModel:
    """Return the first nodes of a tree whose parents stand before their children."""
    graph = tree.skeleton
    return TreeModel(
        Skeleton(graph.xyz[:count], graph.parent[:count], graph.origin, graph.crs),
        tree.radius[:count],
        tree.radius_source[:count],
        tree.radius_rmse[:count],
    )
