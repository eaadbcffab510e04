"""Trees as the cylinder table of TreeQSM in text: 15 columns without a header, a cylinder a row.

The columns are those of TreeQSM's ``cylinder`` in the order of the R package aRchi: radius, length,
start (3), axis (3), parent, extension, added, UnmodRadius, branch, BranchOrder, PositionInBranch. Rows,
branches and positions count from 1, orders from 0; parent and extension 0 are none. TreeQSM's own text
files hold the columns in another order; they are read too.

References
----------
Raumonen, P. et al. (2013). Fast automatic precision tree models from terrestrial laser scanner data.
Remote Sensing 5. https://github.com/InverseTampere/TreeQSM
Martin-Ducup, O. et al. (2020). aRchi. https://cran.r-project.org/package=aRchi
"""

from __future__ import annotations

import os
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pipeline.formats.cylinders import (
    Cylinders,
    equal_volume,
    following,
    foot_radius,
    positions,
    segments,
    tree_of,
)
from pipeline.formats.lines import Row, bad, linked, not_negative, numbers, read_lines, whole
from pipeline.model import Floats, TreeModel
from pipeline.output import write_text

LOSES = ("crs", "origin", "radius source", "radius error", "trunk", "metadata")
"""What a tree has and the file cannot hold."""

PLACE = (
    "radius",
    "length",
    "start x",
    "start y",
    "start z",
    "axis x",
    "axis y",
    "axis z",
    "parent",
    "extension",
)
LINKS = ("branch", "BranchOrder", "PositionInBranch")
COLUMNS = (*PLACE, "added", "UnmodRadius", *LINKS)
VERSION_2_3 = (*PLACE, *LINKS, "added", "UnmodRadius")
VERSION_2_4 = (*PLACE, *LINKS, "mad", "SurfCov", "added", "UnmodRadius")

ROUNDED_M = 3e-6
"""Radii of cylinders that differ by less are the same after rounding to a micrometre."""

KIND = "the cylinders of TreeQSM as .treeqsm.txt"


def write(tree: TreeModel, path: str | os.PathLike[str]) -> None:
    """Write the segments of a tree as cylinders of the same axis and volume.

    ``UnmodRadius`` is the radius at the end of the segment, before it became a cylinder.

    Parameters
    ----------
    tree : TreeModel
    path : path-like

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    cylinders = segments(tree)
    branch, order = tree.skeleton.branch[1:], tree.skeleton.order[1:]
    step = cylinders.end - cylinders.start
    length = np.linalg.norm(step, axis=1)
    axis = np.where(length[:, None] > 0, step / np.where(length > 0, length, 1.0)[:, None], (0.0, 0.0, 1.0))
    rows = zip(
        cylinders.radius.tolist(),
        length.tolist(),
        cylinders.start.tolist(),
        (axis + 0.0).tolist(),
        (cylinders.parent + 1).tolist(),
        (following(cylinders.parent, cylinders.goes_on) + 1).tolist(),
        tree.radius[1:].tolist(),
        (branch + 1).tolist(),
        order.tolist(),
        positions(cylinders.parent, branch).tolist(),
        strict=True,
    )
    lines = [
        f"{r:.6f}\t{n:.9f}\t{s[0]:.6f}\t{s[1]:.6f}\t{s[2]:.6f}\t{a[0]:.9f}\t{a[1]:.9f}\t{a[2]:.9f}"
        f"\t{p}\t{e}\t0\t{u:.6f}\t{b}\t{k}\t{q}"
        for r, n, s, a, p, e, u, b, k, q in rows
    ]
    write_text(path, "".join(f"{line}\n" for line in lines))


def read(path: str | os.PathLike[str]) -> TreeModel:
    """Read a tree, from a table as aRchi or as TreeQSM 2.3 or 2.4 writes it.

    Branches are those of the table; see `pipeline.formats.cylinders.tree_of` for the gaps that
    TreeQSM leaves between cylinders.

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
        If a row has another number of columns, a field is no number, or the rows make no tree.
    """
    return tree_of(read_cylinders(path))


def read_cylinders(path: str | os.PathLike[str]) -> Cylinders:
    """Read the cylinders as they stand in the table, with its gaps; raises what `read` raises."""
    lines = read_lines(path, KIND)
    rows = [Row(k, line.split()) for k, line in enumerate(lines, 1)]
    rows = [row for row in rows if row.fields and not row.fields[0].startswith("#")]
    if rows and rows[0].fields[0].strip('"') == "radius":
        rows = rows[1:]
    if not rows:
        raise bad(path, len(lines), "is the last, and no cylinder came", f"give {KIND}")
    width = len(rows[0].fields)
    if width not in {len(COLUMNS), len(VERSION_2_4)}:
        what = f"has {width} columns, expected 15 (or 17), parted by tabs"
        raise bad(path, rows[0].line, what, f"give {KIND}")
    for row in rows:
        if len(row.fields) != width:
            raise bad(path, row.line, f"has {len(row.fields)} columns, expected {width}", f"give {KIND}")
    names: Sequence[str] = COLUMNS if width == len(COLUMNS) else VERSION_2_4
    table = numbers(path, rows, names)
    if names is COLUMNS and _is_of_version_2_3(table):
        names = VERSION_2_3
    return of_columns(path, rows, dict(zip(names, table.T, strict=True)))


def of_columns(
    path: str | os.PathLike[str], rows: Sequence[Row], column: dict[str, NDArray[np.float64]]
) -> Cylinders:
    """Return the cylinders of TreeQSM's columns, checked.

    Parameters
    ----------
    path : path-like
    rows : sequence of Row
        For the lines that errors name.
    column : dict of str to (M,) array
        By the names of `COLUMNS`; those that are not needed may lack.

    Returns
    -------
    Cylinders

    Raises
    ------
    InputFormatError
        If a radius or length is negative, a number is not whole, or the rows make no tree.
    """
    radius = not_negative(path, rows, column["radius"], "radius")
    length = not_negative(path, rows, column["length"], "length")
    start, axis = (np.column_stack([column[f"{what} {a}"] for a in "xyz"]) for what in ("start", "axis"))
    size = np.linalg.norm(axis, axis=1)
    wrong = np.flatnonzero((np.abs(size - 1) > 0.01) & (length > 0))
    if len(wrong):
        what = f"has an axis of length {size[wrong[0]]:g}, expected a direction of length 1"
        raise bad(path, rows[wrong[0]].line, what, "give the columns in TreeQSM's order")
    end = np.round(start + length[:, None] * axis / np.where(size > 0, size, 1.0)[:, None], 6)
    number = np.arange(1, len(rows) + 1)
    above = whole(path, rows, column["parent"], "parent")
    parent = linked(path, [row.line for row in rows], number, above, none=0)
    branch = whole(path, rows, column["branch"], "branch")
    goes_on = (parent >= 0) & (branch == branch[parent])
    plain = Cylinders(start, end, radius, parent, goes_on)
    told = column.get("UnmodRadius")
    return plain if told is None else _tapered(plain, told)


def _is_of_version_2_3(table: Floats) -> bool:
    """Whether a table of 15 columns has branch, order and position before the unmodified radius."""
    place = COLUMNS.index("branch")
    return bool((table[:, place:] != np.rint(table[:, place:])).any())


def _tapered(plain: Cylinders, told: Floats) -> Cylinders:
    """Return the cylinders with the radii at their ends, where the unmodified radii are those.

    They are in files of our own: each cylinder has the volume of the frustum between them.
    """
    above = np.maximum(plain.parent, 0)
    lowest = int(np.flatnonzero(plain.parent < 0)[0])
    foot = foot_radius(float(plain.radius[lowest]), float(told[lowest]))
    first = np.where(plain.goes_on, told[above], told)
    first[lowest] = foot
    if (told < 0).any() or np.abs(equal_volume(first, told) - plain.radius).max() > ROUNDED_M:
        return plain
    return Cylinders(plain.start, plain.end, plain.radius, plain.parent, plain.goes_on, told, foot)
