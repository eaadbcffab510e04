"""Repeats: sub-trees that are the same within a tolerance become rules, where that shortens the file.

The relative moves of a sub-tree are tried at the foot of every other one of its shape. It stands in
where all nodes come out within the tolerance of where they were, so errors never add up. What is then
the same, forks and all, is told once.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from scipy.sparse import csr_array

from pipeline.lsystem.document import FORMAT, VERSION
from pipeline.lsystem.transforms.factoring import Classes, factored, written_bytes
from pipeline.lsystem.transforms.moves import drawing, moves, nodes_drawn, seeing, squared_distances
from pipeline.lsystem.transforms.subtrees import (
    RULE_BYTES,
    Told,
    radii_with,
    rewritten,
    told_in,
)
from pipeline.model import Floats
from pipeline.options import Options

LARGEST = 64
"""Nodes of a sub-tree that is compared within a tolerance; larger ones are the same or not."""
PAIRS = 4_000_000
"""Nodes that are compared for one shape; of more, every so manieth sub-tree may stand in for others."""
BLOCK = 128
"""Sub-trees that are tried at a time."""
SYMBOL_BYTES = 2
"""Of a rule's name, as far as is known beforehand."""
RADIUS_TOLERANCE_M = 0.001
"""Where a document does not state its own."""

Nodes = NDArray[np.int64]


class RepeatsOptions(Options):
    """How alike sub-trees have to be."""

    tolerance_m: float = Field(
        default=0.005, ge=0, le=1, description="metres that a node may move; 0 finds exact repeats alone"
    )


def repeats(document: Mapping[str, Any], *, options: RepeatsOptions | None = None) -> dict[str, Any]:
    """Tell sub-trees that come again as rules.

    Parameters
    ----------
    document : mapping
        An LsJSON, ours or of 2021; rules that it has are applied first.
    options : RepeatsOptions, optional

    Returns
    -------
    dict
        An LsJSON with as many nodes in the same order, each within the tolerance of where it was. Rules
        may hold other rules; `recursions` says how deep. Written radii stay, those of the pipe rule change by
        no more than the document's `radius.tolerance` where it has written ones. It is never longer
        than what was given.

    Raises
    ------
    InputFormatError
        As `pipeline.lsystem.decode`.
    """
    options = options or RepeatsOptions()
    told = told_in(document)
    classes = Classes(told)
    found = [(told.sheet.axiom, dict(told.sheet.rules)), factored(classes, classes.of_node[0])]
    if options.tolerance_m:
        stand_ins = _stand_ins(told, options.tolerance_m)
        _keep_radii(told, stand_ins, _radius_tolerance(document))
        found.append(factored(classes, classes.with_repeats(stand_ins)))
    axiom, rules = min(found, key=lambda pair: written_bytes(*pair))
    if (axiom, rules) == found[0]:
        ours = {"format": {"name": FORMAT, "version": VERSION}, "recursions": told.sheet.applications}
        return {**document, **ours, "rules": rules}
    return rewritten(document, told, axiom, rules, np.zeros(len(told.size), dtype=bool))


def _stand_ins(told: Told, tolerance: float) -> dict[int, int]:
    """Choose sub-trees to be told as another: the first node of each, and of that which stands in."""
    stand_ins: dict[int, int] = {}
    is_settled = np.zeros(len(told.size), dtype=bool)
    for members in _alike(told):
        free = members[~is_settled[members]]
        count = int(told.size[members[0]])
        for chosen, others in _covers(told, free, tolerance) if len(free) > 1 else ():
            stand_ins.update(dict.fromkeys(others.tolist(), chosen))
            is_settled[others[:, None] + np.arange(count)] = True
    return stand_ins


def _alike(told: Told) -> list[Nodes]:
    """Return the first nodes of sub-trees with the same forks and written radii, large ones first."""
    size, bracketed = told.size.tolist(), told.path.bracketed.tolist()
    width, parent = told.path.width.tolist(), told.path.parent.tolist()
    numbers: dict[tuple[Any, ...], int] = {}
    groups: list[list[int]] = []
    below: list[list[tuple[int, bool]]] = [[] for _ in size]
    for node in range(len(size) - 1, 0, -1):
        if size[node] > LARGEST:
            continue
        key = (width[node] if width[node] == width[node] else None, *below[node])
        shape = numbers.setdefault(key, len(groups))
        if shape == len(groups):
            groups.append([])
        groups[shape].append(node)
        if size[parent[node]] <= LARGEST:
            below[parent[node]].append((shape, bracketed[node]))
    several = [np.array(group[::-1]) for group in groups if len(group) > 1]
    return sorted(several, key=lambda group: (-size[group[0]], group[0]))


def _covers(told: Told, members: Nodes, tolerance: float) -> list[tuple[int, Nodes]]:
    """Choose those of alike sub-trees that save most by standing in for others, and for which.

    Each time the one is taken that saves most bytes among those that are left, while it saves any.
    """
    count = int(told.size[members[0]])
    first_step = np.abs(told.path.length[members])
    order = np.argsort(first_step, kind="stable")
    members, reach = members[order], first_step[order]
    seen = moves(told, members, count)
    near = np.searchsorted(reach, reach + tolerance, side="right") - np.searchsorted(reach, reach - tolerance)
    tried = np.arange(0, len(members), 1 + int(near.sum()) * count // PAIRS)
    fits = _fits(drawing(seen.draw[tried]), seeing(seen), reach[tried], reach, tolerance)
    fitting = fits.tocsc()
    room = (told.end - told.begin)[members].astype(np.float64)
    saves = np.maximum(room - SYMBOL_BYTES, 0)
    gain = fits @ saves - (room[tried] + SYMBOL_BYTES + RULE_BYTES)
    is_free = np.ones(len(members), dtype=bool)
    covers = []
    while gain.max() > 0:
        best = int(gain.argmax())
        taken = fits.indices[fits.indptr[best] : fits.indptr[best + 1]]
        taken = taken[is_free[taken]]
        apart = nodes_drawn(seen.draw[tried[best]], seen.rot[taken, None]) - seen.place[taken]
        taken = taken[np.linalg.norm(apart, axis=2).max(axis=1) <= tolerance]
        covers.append((int(members[tried[best]]), members[taken]))
        is_free[taken] = False
        gain -= fitting[:, taken] @ saves[taken]
        gain[best] = -np.inf
    return covers


def _window(of: Floats, around: Floats, tolerance: float) -> slice:
    """Return where sorted lengths come within the tolerance of any of some others."""
    low = np.searchsorted(of, around.min(initial=np.inf) - tolerance)
    return slice(int(low), int(np.searchsorted(of, around.max(initial=0) + tolerance, side="right")))


def _fits(
    ours: Floats, theirs: Floats, our_reach: Floats, their_reach: Floats, tolerance: float
) -> csr_array:
    """Return the (R, M) pairs of which the first may stand in for the second.

    Both are sorted by the lengths of their first steps, which no foot changes: only pairs whose
    lengths are within the tolerance are looked at.
    """
    blocks = []
    for start in range(0, len(our_reach), BLOCK):
        rows = slice(start, start + BLOCK)
        columns = _window(their_reach, our_reach[rows], tolerance)
        block = np.ones((len(our_reach[rows]), columns.stop - columns.start), dtype=bool)
        for drawn, seen in zip(ours, theirs, strict=True):
            block &= squared_distances(drawn[rows], seen[:, columns]) <= tolerance**2
        row, column = np.nonzero(block)
        blocks.append(np.stack([row + start, column + columns.start]))
    pairs = np.concatenate(blocks, axis=1).astype(np.int32)
    shape = len(our_reach), len(their_reach)
    return csr_array((np.ones(pairs.shape[1], dtype=np.int8), tuple(pairs)), shape=shape)


def _keep_radii(told: Told, stand_ins: dict[int, int], tolerance: float) -> None:
    """Take back what would change a radius of the pipe rule by more than `tolerance`, in metres."""
    path, size = told.path, told.size
    if np.isnan(path.width).all():
        return
    before = radii_with(told, path.length)[0]
    while stand_ins:
        length, within = path.length.copy(), np.zeros(len(size), dtype=np.int64)
        for start, stand_in in stand_ins.items():
            length[start : start + size[start]] = path.length[stand_in : stand_in + size[start]]
            within[start : start + size[start]] = start
        wrong = np.flatnonzero(np.abs(radii_with(told, length)[0] - before) > tolerance)
        if not len(wrong):
            return
        # A radius depends on the wood above its node and on that of its brothers.
        top = np.where(within[wrong] > 0, within[wrong], np.maximum(path.parent[wrong], 0))
        _take_back(stand_ins, top, size)


def _take_back(stand_ins: dict[int, int], tops: Nodes, size: Nodes) -> None:
    """Remove all that stands in for a sub-tree of the nodes `tops`."""
    starts = np.array(sorted(stand_ins))
    for top in np.unique(tops).tolist():
        first, last = np.searchsorted(starts, (top, top + size[top]))
        for start in starts[first:last].tolist():
            stand_ins.pop(start, None)


def _radius_tolerance(document: Mapping[str, Any]) -> float:
    stated = document.get("radius", {}).get("tolerance")
    return float(stated) if isinstance(stated, int | float) else RADIUS_TOLERANCE_M
