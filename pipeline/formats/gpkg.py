"""Trees as GeoPackage, for QGIS and other geographic programs: branches as lines, the tree as a point.

The table ``branches`` has a LINESTRING ZM for every branch, whose M is the radius in metres; a line
starts on its parent's axis with the branch's own radius. ``parent_vertex`` is the place of that start on
the parent's line, from 0, ``nodes`` the numbers that the tree gives to the vertices after it, and
``radius_source`` where their radii come from (of the stem that of its foot, too), as LsJSON tells it. The
table ``trees`` has a POINT Z at the foot, with height, diameter at breast height and volume.

References
----------
Open Geospatial Consortium (2021). OGC GeoPackage Encoding Standard 1.3.1, OGC 12-128r18.
"""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import InputFormatError, InputMissingError
from pipeline.formats.geopackage import add_table, begin, coordinates, geometry
from pipeline.formats.lines import FAR, linked
from pipeline.formats.nodes import Flags, Nodes, Positions
from pipeline.lsystem.radii import sources, sources_text
from pipeline.model import RADIUS_SOURCES, Floats, TreeModel, Trunk
from pipeline.output import whole_file

LOSES = ("radius error", "metadata")
"""What a tree has and the file cannot hold."""

BRANCHES = (
    "branch_id INTEGER, parent_branch_id INTEGER, parent_vertex INTEGER, branch_order INTEGER, "
    "length_m DOUBLE, volume_l DOUBLE, start_radius_m DOUBLE, nodes TEXT, radius_source TEXT"
)
TREES = (
    "crs TEXT, height_m DOUBLE, volume_l DOUBLE, length_m DOUBLE, branches INTEGER, dbh_m DOUBLE, "
    "dbh_lo_m DOUBLE, dbh_hi_m DOUBLE, dbh_arc_deg DOUBLE, dbh_source TEXT, ground_z_m DOUBLE, "
    "origin_x DOUBLE, origin_y DOUBLE, origin_z DOUBLE"
)

KIND = "a .gpkg of treepipe"


def write(tree: TreeModel, path: str | os.PathLike[str]) -> None:
    """Write a tree, to the last bit; the same tree gives the same bytes.

    Parameters
    ----------
    tree : TreeModel
    path : path-like

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    with whole_file(path) as temporary:
        try:
            with closing(sqlite3.connect(temporary)) as file, file:
                file.execute("PRAGMA journal_mode = MEMORY")
                _fill(file, tree)
        except sqlite3.Error as error:
            raise OSError(str(error)) from error


def read(path: str | os.PathLike[str]) -> TreeModel:
    """Read a tree that `write` wrote, or whose branches have been edited since.

    Parameters
    ----------
    path : path-like

    Returns
    -------
    TreeModel
        Nodes have the numbers that the file tells, else they are numbered branch by branch.

    Raises
    ------
    InputMissingError
        If there is no such file.
    InputFormatError
        If it is no GeoPackage of ours, or its branches make no tree.
    """
    if not Path(path).is_file():
        msg = f"{path}: there is no such file; check the name"
        raise InputMissingError(msg)
    branches, trees = _tables(path)
    if len(trees) > 1 or not branches:
        what = f"holds {len(trees)} trees" if len(trees) > 1 else "holds no branch"
        msg = f"{path}: {what}; give a file of one tree"
        raise InputFormatError(msg)
    lines = [_line(path, k, row) for k, row in enumerate(branches, 1)]
    rows = _linked(path, branches)
    world, radius, parent, goes_on = _joined(path, branches, lines, rows)
    known: Mapping[str, Any] = trees[0] if trees else {}
    crs, origin, trunk = _known(path, known)
    node = _told(branches, rows[1], parent)
    new = np.argsort(node)
    above = np.where(parent[node] < 0, -1, new[parent[node]])
    source = _sources(branches, lines, rows[1])[node]
    return Nodes(world[node], above, goes_on[node], crs, origin).tree(radius[node], trunk, source)


def _ranges(numbers: Sequence[int]) -> str:
    """Write increasing numbers as ranges, such as ``1-3 7``."""
    runs: list[list[int]] = []
    for number in numbers:
        if runs and number == runs[-1][1] + 1:
            runs[-1][1] = number
        else:
            runs.append([number, number])
    return " ".join(f"{a}-{b}" if a < b else f"{a}" for a, b in runs)


def _told(branches: Sequence[Mapping[str, Any]], order: Positions, parent: Positions) -> Positions:
    """Return the nodes in the order of the numbers that the branches tell, if those are still right."""
    count, told = len(parent), [0]
    for k in order.tolist():
        text = branches[k].get("nodes")
        for run in text.split() if isinstance(text, str) else ():
            first, _, last = run.partition("-")
            last = last or first
            number = len(last) < 10 and len(first) < 10 and first.isdecimal() and last.isdecimal()
            if not number or int(last) >= count or len(told) > count:
                return np.arange(count)
            told.extend(range(int(first), int(last) + 1))
    rank = np.array(told)
    if len(rank) != count or not np.array_equal(np.sort(rank), np.arange(count)):
        return np.arange(count)
    return np.argsort(rank) if (rank[parent[1:]] < rank[1:]).all() else np.arange(count)


def _fill(file: sqlite3.Connection, tree: TreeModel) -> None:
    """Write both tables."""
    skeleton = tree.skeleton
    srs = begin(file, skeleton.crs)
    add_table(file, "branches", BRANCHES, "LINESTRING", srs, skeleton.world)
    add_table(file, "trees", TREES, "POINT", srs, skeleton.world[:1])
    rows = _branches(tree, srs) if len(skeleton) > 1 else []
    for name, table in (("branches", rows), ("trees", [_tree(tree, srs)])):
        for row in table:
            file.execute(f"INSERT INTO {name} VALUES (NULL{', ?' * len(row)})", row)


def _branches(tree: TreeModel, srs: int) -> list[list[Any]]:
    """Return the rows of the branches."""
    skeleton = tree.skeleton
    position = np.zeros(len(skeleton), dtype=np.int64)
    for nodes in skeleton.paths:
        position[nodes[1:]] = np.arange(1, len(nodes))
    rows: list[list[Any]] = []
    for b, nodes in enumerate(skeleton.paths):
        own = nodes[1:]
        thick = np.concatenate([tree.start_radius[own[:1]], tree.radius[own]])
        line = geometry(np.column_stack([skeleton.world[nodes], thick]), srs)
        where = [b, int(skeleton.branch_parent[b]), int(position[nodes[0]]) if b else None]
        sums = [float(skeleton.length[own].sum()), 1000 * float(tree.volume[own].sum())]
        rows.append(
            [line, *where, int(skeleton.order[own[0]]), *sums, float(thick[0]), _ranges(own.tolist())]
        )
        rows[-1].append(sources_text(tree.radius_source[own if b else nodes]))
    return rows


def _tree(tree: TreeModel, srs: int) -> list[Any]:
    """Return the row of the tree."""
    skeleton, trunk = tree.skeleton, tree.trunk
    ground = trunk.ground_z if trunk else float(skeleton.xyz[0, 2])
    size = [float(skeleton.xyz[:, 2].max() - ground), 1000 * float(tree.volume.sum())]
    size += [float(skeleton.length.sum()), len(skeleton.paths)]
    stem: list[Any] = [None] * 6
    if trunk:
        stem = [trunk.dbh_m, trunk.lo_m, trunk.hi_m, trunk.arc_deg, trunk.source, trunk.ground_z]
    return [geometry(skeleton.world[0], srs), skeleton.crs, *size, *stem, *skeleton.origin.tolist()]


def _tables(path: str | os.PathLike[str]) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Return the rows of both tables by column."""
    try:
        with closing(
            sqlite3.connect(f"{Path(path).absolute().as_uri()}?mode=ro&immutable=1", uri=True)
        ) as file:
            file.row_factory = sqlite3.Row
            names = {row[0] for row in file.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
            branches = [dict(row) for row in file.execute("SELECT * FROM branches ORDER BY fid")]
            trees = file.execute("SELECT * FROM trees ORDER BY fid") if "trees" in names else ()
            return branches, [dict(row) for row in trees]
    except (sqlite3.Error, UnicodeDecodeError, OverflowError, MemoryError) as error:
        msg = f"{path}: is no GeoPackage with a table of branches ({error}); give {KIND}"
        raise InputFormatError(msg) from error


def _bad(path: str | os.PathLike[str], row: int, what: str) -> InputFormatError:
    msg = f"{path}: row {row} of branches {what}; write the file anew"
    return InputFormatError(msg)


def _line(path: str | os.PathLike[str], row: int, branch: Mapping[str, Any]) -> Floats:
    """Return the vertices of a branch, checked."""
    for name in ("branch_id", "parent_branch_id", "parent_vertex"):
        if not isinstance(branch.get(name), int) and not (name == "parent_vertex" and _is_stem(branch)):
            raise _bad(path, row, f"has no whole {name}")
    try:
        line = coordinates(branch.get("geom"))
    except ValueError as error:
        raise _bad(path, row, f"has a geometry that cannot be read ({error})") from error
    if len(line) < 2 or not (np.abs(line) < FAR).all() or (line[:, 3] < 0).any():
        raise _bad(path, row, "has fewer than two vertices, or one that is not finite, or a radius below 0")
    return line


def _is_stem(branch: Mapping[str, Any]) -> bool:
    above = branch.get("parent_branch_id")
    return isinstance(above, int) and above < 0


def _linked(
    path: str | os.PathLike[str], branches: Sequence[Mapping[str, Any]]
) -> tuple[Positions, Positions]:
    """Return the row of every branch's parent, and the rows in the order of their numbers, the stem first."""
    number, above = (
        np.array([max(min(row[name], 2**62), -1) for row in branches], dtype=np.int64)
        for name in ("branch_id", "parent_branch_id")
    )
    where = [f"row {k} of branches" for k in range(1, len(branches) + 1)]
    row_of = linked(path, where, number, above)
    order = np.argsort(number, kind="stable")
    stem = int(np.flatnonzero(row_of < 0)[0])
    return row_of, np.concatenate([[stem], order[order != stem]])


def _joined(
    path: str | os.PathLike[str],
    branches: Sequence[Mapping[str, Any]],
    lines: Sequence[Floats],
    rows: tuple[Positions, Positions],
) -> tuple[Floats, Floats, Positions, Flags]:
    """Return places, radii, parents and what goes on, of the nodes of all branches."""
    row_of, order = rows
    stem = int(order[0])
    first = np.empty(len(lines), dtype=np.int64)  # the node at the second vertex of each branch
    first[order] = 1 + np.cumsum([0, *(len(lines[k]) - 1 for k in order[:-1])])
    parent, goes_on = [-1], [True]
    for k in order.tolist():
        feet = 0
        if k != stem:
            vertex, on = branches[k]["parent_vertex"], int(row_of[k])
            if not 0 <= vertex < len(lines[on]):
                raise _bad(path, k + 1, f"starts at vertex {vertex} of its parent, which is not there")
            while vertex == 0 and on != stem:  # the foot of a branch is a node of the one below
                vertex, on = branches[on]["parent_vertex"], int(row_of[on])
            feet = 0 if vertex == 0 else int(first[on]) + vertex - 1
        own = range(int(first[k]), int(first[k]) + len(lines[k]) - 2)
        parent += [feet, *own]
        goes_on += [k == stem, *[True] * len(own)]
    points = np.concatenate([lines[stem][:1], *(lines[k][1:] for k in order.tolist())])
    return points[:, :3], points[:, 3], np.array(parent, dtype=np.int64), np.array(goes_on)


def _sources(
    branches: Sequence[Mapping[str, Any]], lines: Sequence[Floats], order: Positions
) -> NDArray[np.uint8]:
    """Return where the radii come from, branch by branch; propagated where a branch does not say."""
    found: list[NDArray[np.uint8]] = []
    for k in order.tolist():
        told, count = branches[k].get("radius_source"), len(lines[k]) - bool(found)
        try:
            found.append(sources(told if isinstance(told, str) else None, count))
        except InputFormatError:  # its line has been edited since
            found.append(sources(None, count))
    return np.concatenate(found)


def _known(
    path: str | os.PathLike[str], tree: Mapping[str, Any]
) -> tuple[str | None, Floats | None, Trunk | None]:
    """Return reference system, origin and trunk of a tree."""
    crs = tree.get("crs")
    try:
        origin = np.array([tree.get(f"origin_{a}") for a in "xyz"], dtype=np.float64)
        held = [tree.get(name) for name in ("dbh_m", "dbh_lo_m", "dbh_hi_m", "dbh_arc_deg", "ground_z_m")]
        number = [None if value is None else float(value) for value in held]
    except (TypeError, ValueError) as error:
        msg = f"{path}: its table of trees holds other than numbers ({error}); write the file anew"
        raise InputFormatError(msg) from error
    source = tree.get("dbh_source")
    trunk = None
    if number[3] is not None and number[4] is not None and source in {None, *RADIUS_SOURCES}:
        trunk = Trunk(number[0], number[1], number[2], number[3], source, number[4])
    return crs if isinstance(crs, str) else None, origin if (np.abs(origin) < FAR).all() else None, trunk
