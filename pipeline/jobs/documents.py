"""The L-system of a file, for commands that work on the string; else how to make one of it."""

from __future__ import annotations

import os
from pathlib import Path
from shlex import quote
from typing import Any

from pipeline.cityjson.member import split_feature
from pipeline.cloud import CLOUD_SUFFIXES
from pipeline.errors import InputFormatError
from pipeline.exchange import FORMATS, stem_of
from pipeline.formats.unreadable import ARCHIVE, SURFACES, why_unreadable
from pipeline.lsystem import Archive, read_lsjson, split_member

OURS = (".ls.json", ".ls.json.zst")
MODELS = (*(known.suffix for known in FORMATS.values() if known.read), ".ply", ".csv", ".mat", ".city.jsonl")
"""Suffixes of models; those of `OURS` are among them."""


def read_document(path: Path) -> dict[str, Any]:
    """Read an LsJSON: a file, or a tree of an archive that is named behind it.

    Raises
    ------
    InputMissingError
        If there is no such file, or no such tree.
    InputFormatError
        If it is damaged, or something else than an L-system.
    """
    archive, member = split_member(os.fspath(path))
    if member is not None:
        return Archive(archive).read(member)
    file = Path(split_feature(os.fspath(path))[0])
    name = file.name.lower()
    if name.endswith(OURS) or not file.exists():
        return read_lsjson(file)
    if name.endswith(MODELS):
        made = quote(f"{path.name.partition('#')[2] or stem_of(file)}.ls.json")
        msg = f"{path}: is no L-system; make one of it with `treepipe convert {quote(str(path))} {made}`"
        raise InputFormatError(msg)
    if file.is_dir() or name.endswith((*SURFACES, ARCHIVE, *CLOUD_SUFFIXES)):
        raise InputFormatError(why_unreadable(file, OURS))
    return read_lsjson(file)
