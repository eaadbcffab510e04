"""Trees as a table of tapered cylinders (a quantitative structure model), comma-separated.

A row is a segment; its id is the number of its end node less one. A branch starts on its parent's
axis with its own radius. Coordinates are metres in the system of the input, to 0.01 mm; radii to 1 um.
"""

from __future__ import annotations

import csv
import math
import os
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import InputFormatError, InputMissingError, ModelError
from pipeline.geometry.numbering import by_paths, renumbered
from pipeline.model import RADIUS_SOURCES, Floats, Skeleton, TreeModel
from pipeline.output import write_text

COLUMNS = (
    *("id", "parent_id", "branch_id", "parent_branch_id", "branch_order"),
    *("start_x", "start_y", "start_z", "end_x", "end_y", "end_z"),
    *("start_radius", "end_radius", "radius_source", "radius_se"),
)

SAME_M = 2e-5
"""Two points of a table closer than this are one: twice its rounding."""


def write(tree: TreeModel, path: str | os.PathLike[str]) -> None:
    """Write the segments of a tree.

    Parameters
    ----------
    tree : TreeModel
    path : path-like

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    skeleton = tree.skeleton
    parent = skeleton.parent[1:]
    above = np.maximum(parent - 1, 0)
    above[:1] = -1
    branch = skeleton.branch[1:]
    points = np.round(skeleton.world, 5) + 0.0  # no -0.00000
    rows = zip(
        range(len(skeleton) - 1),
        above.tolist(),
        branch.tolist(),
        skeleton.branch_parent[branch].tolist(),
        skeleton.order[1:].tolist(),
        points[parent].tolist(),
        points[1:].tolist(),
        tree.start_radius[1:].tolist(),
        tree.radius[1:].tolist(),
        (RADIUS_SOURCES[s] for s in tree.radius_source[1:].tolist()),
        tree.radius_rmse[1:].tolist(),
        strict=True,
    )
    crs = " ".join((skeleton.crs or "unknown").split())
    lines = [f"# crs: {crs}; units: m", ",".join(COLUMNS)]
    lines += [
        f"{i},{p},{b},{q},{k},{s[0]:.5f},{s[1]:.5f},{s[2]:.5f},{e[0]:.5f},{e[1]:.5f},{e[2]:.5f},"
        f"{r:.6f},{t:.6f},{source},{'' if math.isnan(error) else f'{error:.6f}'}"
        for i, p, b, q, k, s, e, r, t, source, error in rows
    ]
    write_text(path, "\n".join(lines) + "\n")


def read(path: str | os.PathLike[str]) -> TreeModel:
    """Read a table of segments as a tree.

    Rows may come in any order. The branches are those of ``branch_id``: the nodes are numbered path
    by path where the rows are not. A segment that starts at the foot of the tree hangs on its root,
    any other on the end of its parent, wherever it starts.

    Parameters
    ----------
    path : path-like

    Returns
    -------
    TreeModel
        Its origin is the foot of the tree in whole metres.

    Raises
    ------
    InputMissingError
        If there is no such file.
    InputFormatError
        If columns or rows are missing, a field is no number, or the rows make no tree.
    """
    crs, rows = _rows(path)
    try:
        number = _numbers(rows, "id")
        rows = [rows[k] for k in np.argsort(number, kind="stable")]
        above, start = _numbers(rows, "parent_id"), _points(rows, "start")
        parent = _chained(np.sort(number), above, start)
        lowest = int(np.argmin(above))  # the row without a parent: its start is the root
        return _tree(rows, lowest, parent, start[lowest], crs)
    except (ModelError, ValueError, TypeError) as error:
        msg = f"{path}: {error}; mend the table or write it anew"
        raise InputFormatError(msg) from error


def _tree(
    rows: list[dict[str, str]], lowest: int, parent: NDArray[np.int64], foot: Floats, crs: str | None
) -> TreeModel:
    """Return the tree of the sorted rows; its root shares what the lowest row says."""
    order = [lowest, *range(len(rows))]
    world = _points(rows, "end")[order]
    radius = _numbers(rows, "end_radius")[order]
    world[0], radius[0] = foot, _numbers(rows, "start_radius")[lowest]
    source = _sources(rows)[order]
    error = _numbers([{"radius_se": row["radius_se"] or "nan"} for row in rows], "radius_se", known=False)[
        order
    ]
    node = _kept_or_by_paths(parent, _numbers(rows, "branch_id")[order])
    origin = np.floor(foot)
    skeleton = Skeleton((world - origin)[node], renumbered(parent, node), origin, crs)
    return TreeModel(skeleton, radius[node], source[node], error[node])


def _rows(path: str | os.PathLike[str]) -> tuple[str | None, list[dict[str, str]]]:
    """Return the reference system and the rows by column."""
    try:
        lines = Path(path).read_text(encoding="utf-8").splitlines()
    except (FileNotFoundError, IsADirectoryError) as error:
        msg = f"{path}: there is no such file; check the name"
        raise InputMissingError(msg) from error
    except (OSError, UnicodeDecodeError) as error:
        msg = f"{path}: cannot be read as text ({error}); give a .qsm.csv file"
        raise InputFormatError(msg) from error
    said = [line.partition("crs:")[2].partition(";")[0].strip() for line in lines if line.startswith("#")]
    crs = next((text for text in said if text and text != "unknown"), None)
    table = csv.DictReader(line for line in lines if not line.startswith("#"))
    missing = [name for name in COLUMNS if name not in (table.fieldnames or ())]
    rows = list(table)
    if missing or not rows:
        lacks = f"lacks the columns {', '.join(missing)}" if missing else "has no rows"
        msg = f"{path}: {lacks}; give a .qsm.csv file with a segment"
        raise InputFormatError(msg)
    return crs, rows


def _numbers(rows: list[dict[str, str]], name: str, *, known: bool = True) -> Floats:
    """Return a column as numbers, all of them known unless it may hold NaN."""
    values = []
    for k, row in enumerate(rows):
        try:
            values.append(float(row[name]))
        except (TypeError, ValueError) as error:
            msg = f"{name} of row {k} is {row[name]!r}, which is no number"
            raise ModelError(msg) from error
        if known and not math.isfinite(values[-1]):
            msg = f"{name} of row {k} is not finite"
            raise ModelError(msg)
    return np.array(values)


def _sources(rows: list[dict[str, str]]) -> NDArray[np.uint8]:
    """Return the column of radius sources as indices."""
    known: dict[str, int] = {name: k for k, name in enumerate(RADIUS_SOURCES)}
    for k, row in enumerate(rows):
        if row["radius_source"] not in known:
            msg = f"radius_source of row {k} is {row['radius_source']!r}, not one of {', '.join(known)}"
            raise ModelError(msg)
    return np.array([known[row["radius_source"]] for row in rows], dtype=np.uint8)


def _points(rows: list[dict[str, str]], which: str) -> Floats:
    return np.column_stack([_numbers(rows, f"{which}_{axis}") for axis in "xyz"])


def _chained(number: Floats, above: Floats, start: Floats) -> NDArray[np.int64]:
    """Return the parent of every node: 0 the foot, i + 1 the end of row i."""
    if (np.diff(number) == 0).any():
        msg = f"two rows have the id {number[:-1][np.diff(number) == 0][0]:g}"
        raise ModelError(msg)
    roots = np.flatnonzero(above < 0)
    if len(roots) != 1:
        msg = f"{len(roots)} rows have no parent, expected one: keep one tree a table"
        raise ModelError(msg)
    row = np.searchsorted(number, above).clip(0, len(number) - 1)
    lost = np.flatnonzero((number[row] != above) & (above >= 0))
    if len(lost):
        msg = f"the parent {above[lost[0]]:g} of row {number[lost[0]]:g} is not there"
        raise ModelError(msg)
    at_foot = (row == roots[0]) & (np.abs(start - start[roots[0]]).max(axis=1) < SAME_M)
    parent = np.where((above < 0) | at_foot, 0, row + 1)
    return np.concatenate([[-1], parent])


def _kept_or_by_paths(parent: NDArray[np.int64], branch: Floats) -> NDArray[np.int64]:
    """Return the order of the nodes: as it is where that already shows the branches, else path by path."""
    above = branch[np.maximum(parent, 0)]
    goes_on = branch == above
    count = np.arange(len(parent))
    if (parent < count).all():
        kept = Skeleton(np.zeros((len(parent), 3)), parent.astype(np.int32))
        if np.array_equal(~kept.branch_start[1:], goes_on[1:]):
            return count
    return by_paths(parent, np.ones(len(parent)), goes_on=goes_on)
