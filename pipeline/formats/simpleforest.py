"""Trees as the cylinder table of SimpleForest: comma-separated, columns by name, a cylinder a row.

Ids, branches and segments count from 0, a parent of -1 is none; metres in the coordinates of the cloud.
A segment is what lies between two forks. The last two columns are ours: the radii at the two
ends of what became a cylinder of the same volume. SimpleForest's ``branchID`` is that of the limb:
shoots on it share the number and differ in ``branchOrder``.

References
----------
Hackenberg, J. et al. (2015). SimpleTree - an efficient open source tool to build tree models from TLS
clouds. Forests 6. https://simpleforest.org
"""

from __future__ import annotations

import os
from collections.abc import Sequence

import numpy as np

from pipeline.formats.cylinders import Cylinders, segments, tree_of
from pipeline.formats.lines import Row, bad, linked, not_negative, numbers, read_lines, whole
from pipeline.formats.nodes import Positions
from pipeline.model import Floats, TreeModel
from pipeline.output import write_text

LOSES = ("crs", "origin", "radius source", "radius error", "trunk", "metadata")
"""What a tree has and the file cannot hold."""

MUST = (
    "ID",
    "parentID",
    "branchID",
    "branchOrder",
    "startX",
    "startY",
    "startZ",
    "endX",
    "endY",
    "endZ",
    "radius",
)
ENDS = ("startRadius", "endRadius")
COLUMNS = (*MUST, "length", "segmentID", "parentSegmentID", *ENDS)

KIND = "the cylinders of SimpleForest as .simpleforest.csv"


def write(tree: TreeModel, path: str | os.PathLike[str]) -> None:
    """Write the segments of a tree as cylinders of the same axis and volume.

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
    part, above = _between_forks(cylinders.parent)
    rows = zip(
        cylinders.parent.tolist(),
        tree.skeleton.branch[1:].tolist(),
        tree.skeleton.order[1:].tolist(),
        cylinders.start.tolist(),
        cylinders.end.tolist(),
        cylinders.radius.tolist(),
        np.linalg.norm(cylinders.end - cylinders.start, axis=1).tolist(),
        part.tolist(),
        above.tolist(),
        tree.start_radius[1:].tolist(),
        tree.radius[1:].tolist(),
        strict=True,
    )
    lines = [",".join(COLUMNS)] + [
        f"{i},{p},{b},{k},{s[0]:.6f},{s[1]:.6f},{s[2]:.6f},{e[0]:.6f},{e[1]:.6f},{e[2]:.6f},"
        f"{r:.6f},{n:.6f},{g},{h},{f:.6f},{t:.6f}"
        for i, (p, b, k, s, e, r, n, g, h, f, t) in enumerate(rows)
    ]
    write_text(path, "\n".join(lines) + "\n")


def read(path: str | os.PathLike[str]) -> TreeModel:
    """Read a tree.

    Columns may stand in any order, with spaces around their names; rows may come in any order. A
    cylinder goes on where its parent has the same ``branchID`` and ``branchOrder``.

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
    return tree_of(read_cylinders(path))


def read_cylinders(path: str | os.PathLike[str]) -> Cylinders:
    """Read the cylinders as they stand in the table, with its gaps; raises what `read` raises."""
    rows, names = _rows(path)
    table = numbers(path, rows, names)
    column = dict(zip(names, table.T, strict=True))
    number, above = (whole(path, rows, column[name], name) for name in MUST[:2])
    parent = linked(path, [row.line for row in rows], number, above)
    goes_on = parent >= 0
    for name in ("branchID", "branchOrder"):
        goes_on &= column[name] == column[name][parent]
    start, end = (np.column_stack([column[f"{what}{a}"] for a in "XYZ"]) for what in ("start", "end"))
    radius = not_negative(path, rows, column["radius"], "radius")
    told: Floats | None = None
    foot: float | None = None
    if set(ENDS) <= set(names):
        first, told = (not_negative(path, rows, column[name], name) for name in ENDS)
        foot = float(first[parent < 0][0])
    return Cylinders(start, end, radius, parent, goes_on, told, foot)


def _between_forks(parent: Positions) -> tuple[Positions, Positions]:
    """Return the number of each cylinder's segment, and of the segment below it (-1 for none)."""
    children = np.bincount(parent[parent >= 0], minlength=len(parent)).tolist()
    part: list[int] = []
    above: list[int] = []
    count = 0
    for p in parent.tolist():
        if p >= 0 and children[p] == 1:
            part.append(part[p])
            above.append(above[p])
        else:
            above.append(part[p] if p >= 0 else -1)
            part.append(count)
            count += 1
    return np.array(part, dtype=np.int64), np.array(above, dtype=np.int64)


def _rows(path: str | os.PathLike[str]) -> tuple[list[Row], Sequence[str]]:
    """Return the rows with the columns that are needed, and their names."""
    lines = read_lines(path, KIND)
    table = [(k, [field.strip(' \t"') for field in line.split(",")]) for k, line in enumerate(lines, 1)]
    (line, names), *rest = [(k, fields) for k, fields in table if any(fields)]
    missing = [name for name in MUST if name not in names]
    if missing:
        remedy = "separate columns by commas" if ";" in names[0] else f"give {KIND}"
        raise bad(path, line, f"lacks the columns {', '.join(missing)}", remedy)
    if not rest:
        raise bad(path, line, "is the header, and no cylinder follows", f"give {KIND}")
    wanted = [*MUST, *(name for name in ENDS if name in names)]
    place = [names.index(name) for name in wanted]
    for k, fields in rest:
        if len(fields) != len(names):
            remedy = "write every column, and decimals with a point"
            raise bad(path, k, f"has {len(fields)} columns, expected {len(names)}", remedy)
    return [Row(k, [fields[at] for at in place]) for k, fields in rest], wanted
