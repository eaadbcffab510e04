"""Trees as the tree file of raycloudtools and treetools: one tree a line, its segments after each other.

A segment is ``x,y,z,radius,parent_id,section_id``: its end, the radius of its cylinder, the index of its
parent in the tree (-1 at the root, which is a point) and a number of its own. Coordinates are those
of the cloud, in metres. The radius is that of the cylinder of equal volume; the radii at the nodes,
the reference system and the local origin stand in comments.

References
----------
Lowe, T. and Stepanas, K. (2021). RayCloudTools: a concise interface for analysis and manipulation of
ray clouds. IEEE Access 9. https://github.com/csiro-robotics/treetools
"""

from __future__ import annotations

import os
from collections.abc import Sequence

import numpy as np

from pipeline.formats.cylinders import equal_volume, following
from pipeline.formats.lines import (
    Row,
    bad,
    comments,
    crs_of,
    heading,
    linked,
    not_negative,
    numbers,
    origin_of,
    read_lines,
    whole,
)
from pipeline.formats.nodes import Nodes, untold
from pipeline.model import Floats, Skeleton, TreeModel
from pipeline.output import write_text

LOSES = ("radius source", "radius error", "trunk", "metadata")
"""What a tree has and the file cannot hold."""

MUST = ("x", "y", "z", "radius")
COLUMNS = (*MUST, "parent_id", "section_id")

ROUNDED_M = 3e-6
"""Radii of cylinders that differ by less are the same after rounding to a micrometre."""

NODES = "radius at the nodes"
"""Key of the comment that tells them."""

KIND = "a .treefile.txt of raycloudtools"


def write(tree: TreeModel, path: str | os.PathLike[str]) -> None:
    """Write a tree as one line, to a micrometre.

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
    radius = _cylinders(tree)
    points = (np.round(skeleton.world, 6) + 0.0).tolist()
    rows = zip(points, radius.tolist(), skeleton.parent.tolist(), strict=True)
    segments = [f"{x:.6f},{y:.6f},{z:.6f},{r:.6f},{p},{k}" for k, ((x, y, z), r, p) in enumerate(rows)]
    told = " ".join(f"{r:.6f}" for r in tree.radius.tolist())
    head = ["# Tree file", *heading(skeleton.crs, skeleton.origin), f"# {NODES}: {told}"]
    write_text(path, "\n".join([*head, ",".join(COLUMNS), ", ".join(segments)]) + "\n")


def read(path: str | os.PathLike[str]) -> TreeModel:
    """Read a tree.

    Files of our own keep their numbers and the radii at their nodes, unless the cylinders have been
    changed since. In others the nodes are numbered path by path, on along the child that carries
    the most length, and a node has the mean radius of the two cylinders of its branch that meet there.
    What more a file tells of its trees and segments is not looked at.

    Parameters
    ----------
    path : path-like

    Returns
    -------
    TreeModel

    Raises
    ------
    InputMissingError
        If there is no such file.
    InputFormatError
        If there is not one tree in it, its fields do not fit the header, or they make no tree.
    """
    lines = read_lines(path, KIND)
    said = comments(lines)
    header, tree = _header_and_tree(path, lines)
    rows = _segments(path, header, tree)
    table = numbers(path, rows, COLUMNS[:5])
    cylinder = not_negative(path, rows, table[:, 3], "radius")
    above = whole(path, rows, table[:, 4], "parent_id")
    parent = linked(path, [tree.line] * len(rows), np.arange(len(rows)), above)
    ours, crs, origin = "treepipe" in said, crs_of(said), origin_of(path, said)
    skeleton, node = Nodes(table[:, :3], parent, crs=crs, origin=origin, keep=ours).numbered()
    told = _told(path, said, len(skeleton)) if ours else None
    if told is not None and np.abs(_cylinders(untold(skeleton, told)) - cylinder[node]).max() <= ROUNDED_M:
        return untold(skeleton, told)
    return untold(skeleton, _meeting(skeleton, cylinder[node]))


def _cylinders(tree: TreeModel) -> Floats:
    """(N,) radius of the cylinder that ends at each node; at the root its own."""
    radius = equal_volume(tree.start_radius, tree.radius)
    radius[0] = tree.radius[0]
    return radius


def _header_and_tree(path: str | os.PathLike[str], lines: Sequence[str]) -> tuple[Row, Row]:
    """Return the names of the header and the fields of the one tree."""
    rest = [(k, line) for k, line in enumerate(lines, 1) if line.strip() and not line.startswith("#")]
    names = [name.strip() for name in rest[0][1].replace(" ", ",").split(",")] if rest else []
    names = [name for name in names if name]
    if not _starts(names) or "parent_id" not in names:
        line = rest[0][0] if rest else len(lines)
        raise bad(path, line, f"does not name {','.join(MUST)},parent_id", f"give {KIND}")
    if len(rest) != 2:
        line = rest[2][0] if len(rest) > 2 else rest[0][0]
        what = "begins a second tree" if len(rest) > 2 else "is the header, and no tree follows"
        raise bad(path, line, what, "keep one tree a file")
    fields = rest[1][1].split(",")
    fields = fields[:-1] if not fields[-1].strip() else fields
    return Row(rest[0][0], names), Row(rest[1][0], fields)


def _starts(names: Sequence[str]) -> list[int]:
    """Return where in a header ``x,y,z,radius`` stands."""
    return [k for k in range(len(names)) if tuple(names[k : k + 4]) == MUST]


def _segments(path: str | os.PathLike[str], header: Row, tree: Row) -> list[Row]:
    """Return the first five columns of every segment of a tree.

    What stands before ``x,y,z,radius`` is told once for the tree. Where that stands twice, the names up
    to the second are those of the root.
    """
    names, fields, starts = list(header.fields), list(tree.fields), _starts(header.fields)
    root, each = (names[: starts[1]], names[starts[1] :]) if len(starts) > 1 else (names, names[starts[0] :])
    if len(fields) < len(root) or (len(fields) - len(root)) % len(each) or "parent_id" not in each:
        what = f"has {len(fields)} fields, which is no whole number of segments of {len(each)}"
        raise bad(path, tree.line, what, "write for each the fields that the header names")
    above = fields[root.index("parent_id")] if "parent_id" in root else "-1"
    rows = [Row(tree.line, [*fields[starts[0] : starts[0] + 4], above])]
    place = each.index("parent_id")
    return rows + [
        Row(tree.line, [*fields[at : at + 4], fields[at + place]])
        for at in range(len(root), len(fields), len(each))
    ]


def _told(path: str | os.PathLike[str], said: dict[str, Row], count: int) -> Floats | None:
    """Return the radii at the nodes that a comment tells."""
    if NODES not in said:
        return None
    line, (text,) = said[NODES]
    row = Row(line, text.split())
    if len(row.fields) != count:
        return None
    return not_negative(path, [row] * count, numbers(path, [row], ["radius"] * count)[0], "radius")


def _meeting(skeleton: Skeleton, cylinder: Floats) -> Floats:
    """Return the mean radius of the cylinders of its branch that meet at each node."""
    ahead = following(skeleton.parent.astype(np.int64), ~skeleton.branch_start)
    mean = np.where(ahead >= 0, (cylinder + cylinder[ahead]) / 2, cylinder)
    mean[0] = cylinder[0]
    return mean
