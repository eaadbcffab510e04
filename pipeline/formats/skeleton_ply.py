"""Skeletons as PLY: nodes with their radius, edges from parent to child, in world coordinates.

Opens in CloudCompare, MeshLab and Open3D beside the cloud. Comment lines hold units, reference
system, the local origin, and what is known of the tree as JSON, cut into lines that every reader takes.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import InputFormatError, ModelError
from pipeline.formats.metadata import from_json, to_json, trunk_from_plain, trunk_to_plain
from pipeline.formats.ply import COMMENT_WIDTH, Ply, header, open_ply
from pipeline.geometry.numbering import from_edges, rooted
from pipeline.model import PROPAGATED, Floats, Skeleton, TreeModel
from pipeline.output import write_bytes

MARK = "treepipe "

FAR_M = 1e4
"""Coordinates beyond this are national ones, and a file without an offset is given a local origin."""


def write(value: Skeleton | TreeModel, path: str | os.PathLike[str], *, ascii: bool = False) -> None:
    """Write a skeleton, with radii if it is a tree.

    Parameters
    ----------
    value : Skeleton or TreeModel
    path : path-like
    ascii : bool, optional
        Write text instead of binary numbers; no digit is lost.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    skeleton = value.skeleton if isinstance(value, TreeModel) else value
    edges = np.column_stack([skeleton.parent, np.arange(len(skeleton))])[1:].astype("<i4")
    columns: dict[str, NDArray[Any]] = {
        f"double {axis}": skeleton.world[:, k] for k, axis in enumerate("xyz")
    }
    if isinstance(value, TreeModel):
        columns["double radius"] = value.radius
        columns["uchar radius_source"] = value.radius_source
        columns["double radius_rmse"] = value.radius_rmse
    head = header(
        "ascii" if ascii else "binary_little_endian",
        _comments(value, skeleton),
        {
            "vertex": (len(skeleton), columns),
            "edge": (len(edges), ["int vertex1", "int vertex2"]),
        },
    )
    if ascii:
        rows = zip(*(column.tolist() for column in columns.values()), strict=True)
        lines = [" ".join(map(repr, row)) for row in rows] + [f"{a} {b}" for a, b in edges.tolist()]
        write_bytes(path, head + "".join(f"{line}\n" for line in lines).encode("ascii"))
        return
    kinds = [(name, "u1" if name.startswith("uchar") else "<f8") for name in columns]
    table = np.empty(len(skeleton), dtype=kinds)
    for name, column in columns.items():
        table[name] = column
    write_bytes(path, head + table.tobytes() + edges.tobytes())


def read(path: str | os.PathLike[str]) -> Skeleton | TreeModel:
    """Read a skeleton; a tree where its nodes have a radius.

    Files of our own keep their numbers. In others the edges may point anywhere and the nodes come
    in any order: they are numbered path by path (`pipeline.geometry.numbering.from_edges`), and
    their radii count as measured.

    Parameters
    ----------
    path : path-like

    Returns
    -------
    Skeleton or TreeModel

    Raises
    ------
    InputMissingError
        If there is no such file.
    InputFormatError
        If it is no PLY file, has no edges, or they make no tree.
    """
    ply = open_ply(path)
    vertex, edges = _tables(ply)
    known = _known(ply)
    world = np.column_stack([vertex[axis] for axis in "xyz"]).astype(np.float64)
    try:
        node, parent = _numbered(world, edges, ours=known is not None)
        offset = _offset(ply, world)
        known = known or {}
        crs = known.get("crs") or _comment(ply, "crs")
        held = known.get("skeleton", known.get("metadata", {}))
        # national coordinates cost the last bits; nodes that were whole micrometres are so again
        skeleton = Skeleton(np.round(world[node] - offset, 9), parent, offset, crs, held)
        if "radius" not in vertex:
            return skeleton
        count = len(skeleton)
        source = vertex.get("radius_source", np.full(count, PROPAGATED))[node]
        if ((source < 0) | (source > 255)).any():
            msg = "radius_source is not between 0 and 2"
            raise ModelError(msg)
        return TreeModel(
            skeleton,
            vertex["radius"][node].astype(np.float64),
            source.astype(np.uint8),
            vertex.get("radius_rmse", np.full(count, np.nan))[node].astype(np.float64),
            trunk_from_plain(known.get("trunk")),
            known.get("metadata", {}),
        )
    except (ModelError, TypeError, ValueError) as error:
        msg = f"{path}: {error}"
        raise InputFormatError(msg) from error


def _comments(value: Skeleton | TreeModel, skeleton: Skeleton) -> list[str]:
    crs = skeleton.crs
    lines = ["units m", *([f"crs {crs}"] if crs and crs.isascii() and len(crs.split()) == 1 else [])]
    lines.append("offset " + " ".join(map(repr, skeleton.origin.tolist())))
    known: dict[str, Any] = {"crs": crs, "metadata": _of_the_tree(value.metadata)}
    if isinstance(value, TreeModel):
        known |= {"skeleton": _of_the_tree(skeleton.metadata), "trunk": trunk_to_plain(value.trunk)}
    text = to_json(known)
    width = COMMENT_WIDTH - len(MARK)
    return [line[:COMMENT_WIDTH] for line in lines] + [
        MARK + text[k : k + width] for k in range(0, len(text), width)
    ]


def _of_the_tree(metadata: Mapping[str, Any]) -> dict[str, Any]:
    """Leave out which file the points came from: the same points give the same bytes."""
    return {key: known for key, known in metadata.items() if key != "source"}


def _tables(ply: Ply) -> tuple[dict[str, NDArray[Any]], NDArray[np.int64]]:
    """Return the columns of the nodes, and the two nodes of each edge."""
    edge = ply.element("edge")
    if edge is None or ply.element("vertex") is None:
        msg = f"{ply.path}: has no edges, it is a cloud or a mesh; give a .skeleton.ply"
        raise InputFormatError(msg)
    vertex, ends = ply.columns("vertex"), ply.columns("edge")
    missing = {"x", "y", "z"} - set(vertex)
    if missing or len(ends) < 2:
        lacks = ", ".join(sorted(missing)) or "the two nodes of its edges"
        msg = f"{ply.path}: lacks {lacks}; write the file anew"
        raise InputFormatError(msg)
    pair = [
        ends.get(name, column) for name, column in zip(("vertex1", "vertex2"), ends.values(), strict=False)
    ]
    return vertex, np.column_stack(pair)


def _numbered(
    world: Floats, edges: NDArray[Any], *, ours: bool
) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """Return which node comes where, and its parent."""
    if ours and not len(edges) and len(world) == 1:
        return np.zeros(1, dtype=np.int64), np.full(1, -1, dtype=np.int32)
    if ours:
        parent = rooted(len(world), edges)
        if (parent < np.arange(len(parent))).all():
            return np.arange(len(parent)), parent.astype(np.int32)
    return from_edges(world, edges)


def _known(ply: Ply) -> Mapping[str, Any] | None:
    """Return what the JSON in the comments says; None in files that are not ours."""
    text = "".join(line.removeprefix(MARK) for line in ply.comments if line.startswith(MARK))
    if not text:
        return None
    try:
        known = from_json(text)
    except ValueError as error:
        msg = f"{ply.path}: its treepipe comments are damaged ({error}); remove them or write the file anew"
        raise InputFormatError(msg) from error
    return known if isinstance(known, Mapping) else {}


def _comment(ply: Ply, key: str) -> str | None:
    """Return the rest of the comment that begins with `key`."""
    return next(
        (c.split(None, 1)[1].strip() for c in ply.comments if c.split()[:1] == [key] and len(c.split()) > 1),
        None,
    )


def _offset(ply: Ply, world: Floats) -> Floats:
    """Return the local origin that the comments name; else a whole one where coordinates are large."""
    said = _comment(ply, "offset")
    if said is None:
        return np.floor(world.min(axis=0)) if np.abs(world).max() > FAR_M else np.zeros(3)
    numbers = [float(word) for word in said.split()]
    if len(numbers) != 3 or not np.isfinite(numbers).all():
        msg = f"its offset {said!r} is not three numbers; mend the comment"
        raise ModelError(msg)
    return np.array(numbers)
