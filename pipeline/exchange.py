"""Formats by name and suffix: one table to write any of them, one function to read any model."""

from __future__ import annotations

import difflib
import os
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from pipeline.cityjson import from_cityjson, read_cityjson, to_cityjson, write_cityjson
from pipeline.config import Config
from pipeline.errors import InputFormatError, InputMissingError, UsageError
from pipeline.formats import mesh_ply, model_npz, qsm, skeleton_ply
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
from pipeline.mesh import tubes
from pipeline.model import Skeleton, TreeModel
from pipeline.output import write_text

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
    is_city = path.is_file() and b'"CityJSON"' in path.read_bytes()
    return _read_cityjson(path) if is_city else _read_lsjson(path)


def _write_mesh(tree: TreeModel, path: Path, _config: Config) -> None:
    mesh_ply.write(tubes(tree), path)


def _plainly(write_file: Callable[[TreeModel, Path], None]) -> Writer:
    """Make a writer of a function that has no options."""
    return lambda tree, path, _config: write_file(tree, path)


FORMATS: dict[str, Format] = {
    "lsjson": Format(".ls.json", _write_lsjson, _read_lsjson),
    "cityjson": Format(".city.json", _write_cityjson, _read_cityjson),
    "skeleton": Format(".skeleton.ply", _plainly(skeleton_ply.write), skeleton_ply.read),
    "mesh": Format(".mesh.ply", _write_mesh, loses=("the skeleton", "radii", "branch order", "the CRS")),
    "qsm": Format(".qsm.csv", _plainly(qsm.write), qsm.read),
    "lsjson-zst": Format(".ls.json.zst", _write_lsjson, _read_lsjson),
    "lstring": Format(
        ".lstring",
        _write_lstring,
        _read_lstring,
        ("radius errors", "radius sources", "the diameter at breast height"),
    ),
    "npz": Format(".npz", _plainly(model_npz.write), model_npz.read),
}

_READ_BESIDE: dict[str, Reader] = {".ply": skeleton_ply.read, ".csv": qsm.read, ".json": _read_json}
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
        Ends in the suffix of a format that can be read (any ``.ply`` with edges is a skeleton, a plain
        ``.json`` is read as what it holds), or is an archive with a tree's name: ``A.lsjson.jsonl.zst#oak``.

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
    source = Path(path)
    reader = _reader(source)
    if reader is None:
        readable = [known.suffix for known in FORMATS.values() if known.read]
        msg = f"{source}: is no model that can be read; give one of {', '.join(readable)}"
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
