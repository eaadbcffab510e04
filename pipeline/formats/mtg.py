"""Trees as MTG, the multiscale tree graph of OpenAlea, in the form A: a node a line, a column an order.

The plant ``P`` (scale 1) decomposes into nodes ``N`` (scale 2). A line begins with as many tabs as the
order of its branch; ``^<N7`` follows the last node of the same column, ``+N8`` starts a branch on the last
one of the column before. The features are ``XX YY ZZ``, metres in the coordinates of the cloud, and
``TopDia``, the diameter at the node in metres. The index of a node is its number in the tree.

References
----------
Godin, C. and Caraglio, Y. (1998). A multiscale model of plant topological structures. Journal of
Theoretical Biology 191. https://mtg.readthedocs.io
"""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from typing import NamedTuple

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
)
from pipeline.formats.nodes import Nodes
from pipeline.model import Skeleton, TreeModel
from pipeline.output import write_text

LOSES = ("radius source", "radius error", "trunk", "metadata")
"""What a tree has and the file cannot hold."""

PLACE = ("XX", "YY", "ZZ")
DIAMETERS = ("TopDia", "diameter", "Diameter")
RADII = ("radius", "Radius")

HEAD = """CODE:\tFORM-A

CLASSES:
SYMBOL\tSCALE\tDECOMPOSITION\tINDEXATION\tDEFINITION
$\t0\tFREE\tFREE\tIMPLICIT
P\t1\tCONNECTED\tFREE\tEXPLICIT
N\t2\tNONE\tFREE\tEXPLICIT

DESCRIPTION:
LEFT\tRIGHT\tRELTYPE\tMAX
N\tN\t<\t?
N\tN\t+\t?

FEATURES:
NAME\tTYPE
XX\tREAL
YY\tREAL
ZZ\tREAL
TopDia\tREAL

MTG:"""

KIND = "an .mtg of form A"

TOKEN = re.compile(r"(<<|[/<+])([A-Za-z$]+)(\d*)")
ENTITY = re.compile(r"(\^?)((?:(?:<<|[/<+])[A-Za-z$]+\d*)+)")


class _Vertex(NamedTuple):
    """A node as its line tells it: `rank` is its index, `above` the place of its parent or -1."""

    line: int
    edge: str
    rank: int | None
    above: int


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
    order = skeleton.order.tolist()
    columns = max(order) + 1
    points = (np.round(skeleton.world, 6) + 0.0).tolist()
    starts = skeleton.branch_start.tolist()
    lines = [*heading(skeleton.crs, skeleton.origin), HEAD]
    lines.append("\t".join(["ENTITY-CODE", *[""] * (columns - 1), *PLACE, DIAMETERS[0]]))
    lines.append("/P1")
    for i in _along(skeleton):
        entity = f"+N{i}" if starts[i] else f"^<N{i}" if i else "^/N0"
        x, y, z = (f"{value:.6f}" for value in points[i])
        after = [""] * (columns - 1 - order[i])
        fields = [*[""] * order[i], entity, *after, x, y, z, f"{2 * tree.radius[i]:.6f}"]
        lines.append("\t".join(fields))
    write_text(path, "\n".join(lines) + "\n")


def read(path: str | os.PathLike[str]) -> TreeModel | Skeleton:
    """Read a tree; a skeleton where no feature tells diameter or radius.

    The vertices of the finest scale are the nodes. ``+`` starts a branch, ``<`` goes on; of several that
    go on, the one that carries the most length does.

    Parameters
    ----------
    path : path-like

    Returns
    -------
    TreeModel or Skeleton

    Raises
    ------
    InputMissingError
        If there is no such file.
    InputFormatError
        If sections are missing, a line cannot be understood, or the vertices make no tree.
    """
    lines = read_lines(path, KIND)
    said = comments(lines)
    scales, at = _scales(path, lines)
    head, names = _features(path, lines, at)
    finest = max(scales.values())
    vertices, fields = _vertices(
        path, lines[head:], head + 1, {s for s, k in scales.items() if k == finest}, names
    )
    rows = [Row(v.line, f) for v, f in zip(vertices, fields, strict=True)]
    if not rows:
        raise bad(
            path, head, "is the last of the header, and no vertex with XX, YY, ZZ follows", f"give {KIND}"
        )
    wanted = [*PLACE, *_thickness(names)]
    table = numbers(path, rows, wanted)
    count = np.arange(len(rows))
    linked(path, [v.line for v in vertices], count, np.array([v.above for v in vertices]))
    place = _by_index(vertices)
    new = np.argsort(place)
    parent = np.array([vertices[k].above for k in place])
    parent = np.where(parent < 0, -1, new[parent])
    goes_on = np.array([vertices[k].edge != "+" for k in place])
    nodes = Nodes(table[place, :3], parent, goes_on, crs_of(said), origin_of(path, said))
    if len(wanted) == 3:
        return nodes.skeleton()
    scale = 0.5 if wanted[3] in DIAMETERS else 1.0
    return nodes.tree(not_negative(path, rows, table[:, 3], wanted[3])[place] * scale)


def _along(skeleton: Skeleton) -> list[int]:
    """Return the nodes in the order of their lines: the branches on a node before the node that follows."""
    ahead, children = skeleton.continuation.tolist(), skeleton.children
    order: list[int] = []
    waiting = [0]
    while waiting:
        i = waiting.pop()
        order.append(i)
        if ahead[i] >= 0:
            waiting.append(ahead[i])
        waiting.extend(c for c in reversed(children[i]) if c != ahead[i])
    return order


def _scales(path: str | os.PathLike[str], lines: Sequence[str]) -> tuple[dict[str, int], int]:
    """Return the scale of every symbol, and the place of the line ``MTG:``."""
    titles = {
        line.split(":")[0].strip(): k for k, line in enumerate(lines) if ":" in line and line[:1] != "#"
    }
    missing = [name for name in ("CODE", "CLASSES", "FEATURES", "MTG") if name not in titles]
    if missing:
        raise bad(path, len(lines), f"ends without the sections {', '.join(missing)}", f"give {KIND}")
    if "FORM-A" not in lines[titles["CODE"]]:
        raise bad(path, titles["CODE"] + 1, "names another form than FORM-A", "save it in form A")
    scales: dict[str, int] = {}
    for k in range(titles["CLASSES"] + 1, len(lines)):
        fields = lines[k].split("#")[0].split()
        if k in titles.values():
            break
        if len(fields) > 1 and fields[1].isascii() and fields[1].isdigit():
            scales[fields[0]] = int(fields[1][:9])
    scales.pop("$", None)
    if not scales:
        raise bad(path, titles["CLASSES"] + 1, "has no class with a scale", "name the classes, as P 1")
    return scales, titles["MTG"]


def _features(path: str | os.PathLike[str], lines: Sequence[str], at: int) -> tuple[int, dict[str, int]]:
    """Return the place of the first vertex, and the column of every feature."""
    for k in range(at + 1, len(lines)):
        if lines[k].startswith(("ENTITY-CODE", "TOPO")):
            columns = {name.strip(): c for c, name in enumerate(lines[k].split("\t")) if name.strip()}
            missing = [name for name in PLACE if name not in columns]
            if missing:
                what = f"lacks the features {', '.join(missing)}"
                raise bad(path, k + 1, what, "give every vertex its coordinates, columns parted by tabs")
            return k + 1, columns
    raise bad(path, at + 1, "is not followed by ENTITY-CODE", f"give {KIND}")


def _thickness(names: dict[str, int]) -> list[str]:
    """Return the feature that tells how thick a vertex is, if there is one."""
    return [name for name in (*DIAMETERS, *RADII) if name in names][:1]


def _vertices(
    path: str | os.PathLike[str], lines: Sequence[str], first: int, finest: set[str], names: dict[str, int]
) -> tuple[list[_Vertex], list[list[str]]]:
    """Return the vertices of the finest scale with their coordinates and thickness."""
    wanted = [names[name] for name in (*PLACE, *_thickness(names))]
    vertices: list[_Vertex] = []
    fields: list[list[str]] = []
    last: dict[int, tuple[int, str]] = {}  # by column: the node last met, and the edge it waits with
    for number, line in enumerate(lines, first):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        cells = line.split("\t")
        column = next(c for c, cell in enumerate(cells) if cell.strip())
        match = ENTITY.fullmatch(cells[column].strip())
        if match is None or column >= min(wanted):
            what = f"has the entity {cells[column].strip()[:40]!r}"
            raise bad(path, number, what, "write / < or + and a class, ^ before it to follow the same column")
        tokens = TOKEN.findall(match[2])
        if any(edge == "<<" for edge, _, _ in tokens) or any(kind in finest for _, kind, _ in tokens[:-1]):
            what = f"has {cells[column].strip()[:40]!r}, several nodes with the coordinates of one"
            raise bad(path, number, what, "give every node its line")
        last = {c: told for c, told in last.items() if c <= column}
        node, waits = _reference(last, column, same=bool(match[1]))
        edge = next((e for e, _, _ in tokens if e != "/"), waits)
        if tokens[-1][1] not in finest:
            last[column] = node, edge
            continue
        cells += [""] * (max(wanted) + 1 - len(cells))
        index = tokens[-1][2]
        vertices.append(
            _Vertex(number, edge, int(index[:18]) if index else None, -1 if edge == "/" else node)
        )
        fields.append([cells[c] for c in wanted])
        last[column] = len(vertices) - 1, "/"
    return vertices, fields


def _reference(last: dict[int, tuple[int, str]], column: int, *, same: bool) -> tuple[int, str]:
    """Return the node that a line refers to: the last of its column, or of the next one to the left."""
    if same:
        return last.get(column, (-1, "/"))
    left = [c for c in last if c < column]
    return last[max(left)] if left else (-1, "/")


def _by_index(vertices: Sequence[_Vertex]) -> list[int]:
    """Return the vertices in the order of their index, or of their lines if that is no numbering of them."""
    index = [v.rank for v in vertices]
    count = len(vertices)
    if any(k is None for k in index) or len(set(index)) < count:
        return list(range(count))
    order = sorted(range(count), key=lambda k: vertices[k].rank or 0)
    place = {k: at for at, k in enumerate(order)}
    backward = any(v.above >= 0 and place[v.above] > place[k] for k, v in enumerate(vertices))
    return list(range(count)) if backward else order
