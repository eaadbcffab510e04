"""Trees as SWC, the format of traced neurons: a node a line, ``id type x y z radius parent``.

Coordinates and radii are metres, relative to the origin that the header names; ids from 1, the root's
parent is -1, parents come first. The type of every node is 0, undefined.

References
----------
Cannon, R. C., Turner, D. A., Pyapali, G. K. and Wheal, H. V. (1998). An on-line archive of
reconstructed hippocampal neurons. Journal of Neuroscience Methods 84.
https://swc-specification.readthedocs.io
"""

from __future__ import annotations

import os

import numpy as np

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
from pipeline.formats.nodes import Nodes
from pipeline.model import TreeModel
from pipeline.output import write_text

LOSES = ("radius source", "radius error", "trunk", "metadata")
"""What a tree has and the file cannot hold."""

COLUMNS = ("id", "type", "x", "y", "z", "radius", "parent")

UNITS = {"m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 0.001, "um": 1e-6}
"""Metres of the units that the header may name; without one the numbers are metres."""


def write(tree: TreeModel, path: str | os.PathLike[str]) -> None:
    """Write a tree, to a micrometre.

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
    lines = [*heading(skeleton.crs, skeleton.origin), f"# {' '.join(COLUMNS)}"]
    points = (np.round(skeleton.xyz, 6) + 0.0).tolist()
    rows = zip(points, tree.radius.tolist(), skeleton.parent.tolist(), strict=True)
    lines += [
        f"{k} 0 {x:.6f} {y:.6f} {z:.6f} {r:.6f} {p + 1 if p >= 0 else -1}"
        for k, ((x, y, z), r, p) in enumerate(rows, 1)
    ]
    write_text(path, "\n".join(lines) + "\n")


def read(path: str | os.PathLike[str]) -> TreeModel:
    """Read a tree.

    Files of our own keep their numbers. In others nodes may come in any order: they are numbered path
    by path, on along the child that carries the most length. The types are not looked at.

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
        If a line has not seven numbers, or the nodes make no tree.
    """
    lines = read_lines(path, "an .swc file")
    said = comments(lines)
    rows = [Row(k, line.split()) for k, line in enumerate(lines, 1) if line.strip()]
    rows = [row for row in rows if not row.fields[0].startswith("#")]
    for row in rows:
        if len(row.fields) != len(COLUMNS):
            what = f"has {len(row.fields)} fields, expected {len(COLUMNS)}"
            raise bad(path, row.line, what, f"write {' '.join(COLUMNS)}")
    if not rows:
        raise bad(path, len(lines), "is the last, and no node came", "give an .swc file with a node")
    table = numbers(path, rows, COLUMNS)
    unit = _unit(path, said)
    radius = not_negative(path, rows, table[:, 5], "radius") * unit
    number, above = whole(path, rows, table[:, 0], "id"), whole(path, rows, table[:, 6], "parent")
    parent = linked(path, [row.line for row in rows], number, above)
    origin = origin_of(path, said)
    local = table[:, 2:5] * unit
    ours = "treepipe" in said
    if origin is None:
        return Nodes(local, parent, crs=crs_of(said), keep=ours).tree(radius)
    return Nodes(local + origin, parent, crs=crs_of(said), origin=origin, keep=ours).tree(radius)


def _unit(path: str | os.PathLike[str], said: dict[str, Row]) -> float:
    """Return the metres of the unit that the header names."""
    if "units" not in said:
        return 1.0
    line, (name,) = said["units"]
    if name.lower() not in UNITS:
        raise bad(path, line, f"names the unit {name[:20]!r}", f"give one of {', '.join(UNITS)}")
    return UNITS[name.lower()]
