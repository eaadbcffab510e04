"""Formats by name and suffix: one table to write any of them, one function to read any model."""

from __future__ import annotations

import difflib
import os
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from pipeline.cityjson import from_cityjson, read_cityjson, to_cityjson, write_cityjson
from pipeline.cityjson.member import read_feature, split_feature
from pipeline.config import Config
from pipeline.errors import InputFormatError, InputMissingError, UsageError
from pipeline.formats import (
    adtree_ply,
    glb,
    gpkg,
    mesh_ply,
    model_npz,
    mtg,
    obj,
    qsm,
    simpleforest,
    skeleton_ply,
    swc,
    treefile,
    treeqsm,
    treeqsm_mat,
)
from pipeline.formats.ply import open_ply
from pipeline.formats.unreadable import why_unreadable
from pipeline.lsystem import (
    Archive,
    decode,
    encode,
    from_lstring,
    read_lsjson,
    split_member,
    to_lstring,
    write_lsjson,
)
from pipeline.mesh import Mesh, build, union
from pipeline.mesh.look import Look
from pipeline.model import Skeleton, TreeModel
from pipeline.output import write_text
from pipeline.synthetic import holds_truth, read_truth, tree_of

DEFAULT_FORMATS = ("lsjson", "cityjson", "skeleton", "mesh", "qsm")

Writer = Callable[[TreeModel, Path, Config], None]
Reader = Callable[[Path], TreeModel | Skeleton]


class Format(NamedTuple):
    """A format's suffix, its writer, its reader where it holds a tree, and what it cannot hold."""

    suffix: str
    write: Writer
    read: Reader | None = None
    loses: tuple[str, ...] = ()


def _write_lsjson(tree: TreeModel, path: Path, config: Config) -> None:
    write_lsjson(encode(tree, options=config.lsystem), path)


def _read_lsjson(path: Path) -> TreeModel:
    return decode(read_lsjson(path))


def _write_lstring(tree: TreeModel, path: Path, config: Config) -> None:
    write_text(path, to_lstring(tree, config.lstring.profile))


def _read_lstring(path: Path) -> TreeModel:
    try:
        tree = from_lstring(path.read_text(encoding="utf-8-sig"))
        if len(tree) < 2:
            msg = "draws nothing; give an L-string with an F"
            raise InputFormatError(msg)
        return tree
    except (OSError, UnicodeDecodeError) as error:
        msg = f"{path}: cannot be read as text in UTF-8 ({error}); give an .lstring file"
        raise InputFormatError(msg) from error
    except InputFormatError as error:
        msg = f"{path}: {error}"
        raise InputFormatError(msg) from error


def _write_cityjson(tree: TreeModel, path: Path, config: Config) -> None:
    write_cityjson(to_cityjson(tree, name=stem_of(path), options=config.cityjson), path)


def _read_cityjson(path: Path) -> TreeModel:
    try:
        return from_cityjson(read_cityjson(path))
    except InputFormatError as error:
        if str(error).startswith(str(path)):
            raise
        msg = f"{path}: {error}"
        raise InputFormatError(msg) from error


def _read_json(path: Path) -> TreeModel:
    """Read a .json without a telling suffix, such as the L-systems of 2021."""
    return (_read_cityjson if b'"CityJSON"' in path.read_bytes() else _read_lsjson)(path)


def _surface(tree: TreeModel, config: Config) -> Mesh:
    return (union if config.mesh.union else build)(tree, options=config.mesh)


def _write_mesh(tree: TreeModel, path: Path, config: Config) -> None:
    mesh_ply.write(_surface(tree, config), path)


def _write_obj(tree: TreeModel, path: Path, config: Config) -> None:
    obj.write(_surface(tree, config), path)


def _write_glb(tree: TreeModel, path: Path, config: Config) -> None:
    glb.write(_surface(tree, config), path)


def _read_npz(path: Path) -> TreeModel:
    """Read a model of ours, or a known truth."""
    return tree_of(read_truth(path)) if holds_truth(path) else model_npz.read(path)


def _read_ply(path: Path) -> TreeModel | Skeleton:
    """Read the edges of a .ply: AdTree's are lists."""
    edge = open_ply(path).element("edge")
    return adtree_ply.read(path) if edge is not None and edge.has_lists else skeleton_ply.read(path)


def _plainly(write_file: Callable[[TreeModel, Path], None]) -> Writer:
    """Make a writer of a function that has no options."""
    return lambda tree, path, _config: write_file(tree, path)


def write_surface(mesh: Mesh, path: Path, look: Look) -> None:
    """Write a mesh that is drawn already, with its colours and pictures; the suffix is one of `SURFACES`."""
    SURFACES[format_of(path).suffix](mesh, path, look=look)


SURFACES: dict[str, Callable[..., None]] = {".mesh.ply": mesh_ply.write, ".obj": obj.write, ".glb": glb.write}
"""Writers of a mesh by suffix."""

SHAPE_ALONE = ("skeleton", "radii", "branch order", "trunk", "metadata")
"""What a surface does not hold; the CRS stands in a comment."""

FORMATS: dict[str, Format] = {
    "lsjson": Format(".ls.json", _write_lsjson, _read_lsjson),
    "cityjson": Format(".city.json", _write_cityjson, _read_cityjson),
    "skeleton": Format(".skeleton.ply", _plainly(skeleton_ply.write), skeleton_ply.read),
    "mesh": Format(".mesh.ply", _write_mesh, loses=SHAPE_ALONE),
    "qsm": Format(".qsm.csv", _plainly(qsm.write), qsm.read),
    "swc": Format(".swc", _plainly(swc.write), swc.read, swc.LOSES),
    "treefile": Format(".treefile.txt", _plainly(treefile.write), treefile.read, treefile.LOSES),
    "treeqsm": Format(".treeqsm.txt", _plainly(treeqsm.write), treeqsm.read, treeqsm.LOSES),
    "simpleforest": Format(
        ".simpleforest.csv", _plainly(simpleforest.write), simpleforest.read, simpleforest.LOSES
    ),
    "mtg": Format(".mtg", _plainly(mtg.write), mtg.read, mtg.LOSES),
    "gpkg": Format(".gpkg", _plainly(gpkg.write), gpkg.read, gpkg.LOSES),
    "lsjson-zst": Format(".ls.json.zst", _write_lsjson, _read_lsjson),
    "lstring": Format(
        ".lstring", _write_lstring, _read_lstring, ("radius source", "radius error", "trunk", "metadata")
    ),
    "obj": Format(".obj", _write_obj, loses=SHAPE_ALONE),
    "glb": Format(".glb", _write_glb, loses=SHAPE_ALONE),
    "npz": Format(".npz", _plainly(model_npz.write), _read_npz),
}

_READ_BESIDE: dict[str, Reader] = {
    ".ply": _read_ply,
    ".csv": qsm.read,
    ".json": _read_json,
    ".jsonl": read_feature,
    ".mat": treeqsm_mat.read,
}
"""Readers of suffixes that do not name a format by themselves; what is inside decides."""


def parse_formats(text: str) -> tuple[str, ...]:
    """Return the formats of a comma list, each once, in the order given.

    Parameters
    ----------
    text : str
        Names of `FORMATS`, such as ``"lsjson,mesh"``.

    Raises
    ------
    UsageError
        If a name is not known, or there is none.
    """
    names = [part.strip() for part in text.split(",") if part.strip()]
    known = ", ".join(FORMATS)
    if not names:
        msg = f"no format is named in {text!r}; give a comma list of {known}"
        raise UsageError(msg)
    for name in names:
        if name not in FORMATS:
            near = difflib.get_close_matches(name, FORMATS, n=1)
            meant = f", do you mean {near[0]}?" if near else ";"
            msg = f"unknown format {name!r}{meant} known: {known}"
            raise UsageError(msg)
    return tuple(dict.fromkeys(names))


def write(tree: TreeModel, path: str | os.PathLike[str], config: Config | None = None) -> None:
    """Write a tree in the format that the suffix of `path` names.

    Parameters
    ----------
    tree : TreeModel
    path : path-like
        Ends in a suffix of `FORMATS`; an existing file is replaced.
    config : Config, optional

    Raises
    ------
    UsageError
        If the suffix names no format.
    OutputError
        If the file cannot be written.
    """
    target = Path(path)
    format_of(target).write(tree, target, config or Config())


def format_of(path: str | os.PathLike[str]) -> Format:
    """Return the format that the suffix of a file to be written names.

    Raises
    ------
    UsageError
        If there is none, listing the suffixes there are.
    """
    name = Path(path).name.lower()
    for known in FORMATS.values():
        if name.endswith(known.suffix):
            return known
    msg = f"{path}: the suffix names no format; end the name in {', '.join(_suffixes())}"
    raise UsageError(msg)


def read_model(path: str | os.PathLike[str]) -> TreeModel | Skeleton:
    """Read a tree, or a skeleton where the file holds no radii.

    Parameters
    ----------
    path : path-like
        Ends in the suffix of a format that can be read (a ``.ply`` with edges is a skeleton, a ``.json``
        what it holds), or names one tree of many: ``A.lsjson.jsonl.zst#oak``, ``A.city.jsonl#oak``.

    Raises
    ------
    InputMissingError
        If there is no such file.
    InputFormatError
        If the suffix is of no model, or the file is damaged.
    """
    archive, member = split_member(os.fspath(path))
    if member is not None:
        return decode(Archive(archive).read(member))
    if split_feature(os.fspath(path))[1] is not None:
        return read_feature(path)
    source = Path(path)
    reader = _reader(source)
    if reader is None or source.is_dir():
        msg = why_unreadable(source, [known.suffix for known in FORMATS.values() if known.read])
        raise InputFormatError(msg)
    if not source.is_file():
        msg = f"{source}: there is no such file; check the name"
        raise InputMissingError(msg)
    return reader(source)


def stem_of(path: str | os.PathLike[str]) -> str:
    """Return the name of a file without folder and format suffix: ``oak`` of ``out/oak.ls.json``."""
    name = Path(path).name
    for suffix in sorted(_suffixes(), key=len, reverse=True):
        if name.lower().endswith(suffix) and len(name) > len(suffix):
            return name[: -len(suffix)]
    return Path(path).stem


def _suffixes() -> list[str]:
    return [known.suffix for known in FORMATS.values()]


def _reader(path: Path) -> Reader | None:
    name = path.name.lower()
    for known in FORMATS.values():
        if name.endswith(known.suffix):
            return known.read
    return _READ_BESIDE.get(path.suffix.lower())
