"""Trees as one archive of arrays: everything that a `TreeModel` holds, to the last bit."""

from __future__ import annotations

import io
import os
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import InputFormatError, InputMissingError, ModelError
from pipeline.formats.metadata import from_json, to_json, trunk_from_plain, trunk_to_plain
from pipeline.model import Skeleton, TreeModel
from pipeline.output import write_bytes

ARRAYS = ("xyz", "parent", "origin", "radius", "radius_source", "radius_rmse")
NO_TIME = (1980, 1, 1, 0, 0, 0)


def write(tree: TreeModel, path: str | os.PathLike[str]) -> None:
    """Write a tree; the same tree gives the same bytes.

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
    known = {
        "format": "treepipe-model",
        "version": 1,
        "crs": skeleton.crs,
        "metadata": tree.metadata,
        "skeleton": skeleton.metadata,
        "trunk": trunk_to_plain(tree.trunk),
    }
    arrays = {
        "xyz": skeleton.xyz,
        "parent": skeleton.parent,
        "origin": skeleton.origin,
        "radius": tree.radius,
        "radius_source": tree.radius_source,
        "radius_rmse": tree.radius_rmse,
        "json": np.frombuffer(to_json(known).encode("ascii"), dtype=np.uint8),
    }
    whole = io.BytesIO()
    with zipfile.ZipFile(whole, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, array in arrays.items():
            part = io.BytesIO()
            np.lib.format.write_array(part, np.ascontiguousarray(array), allow_pickle=False)
            entry = zipfile.ZipInfo(f"{name}.npy", NO_TIME)
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, part.getvalue())
    write_bytes(path, whole.getvalue())


def read(path: str | os.PathLike[str]) -> TreeModel:
    """Read a tree that `write` wrote.

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
        If it is another kind of archive, or damaged.
    """
    arrays = _arrays(path)
    missing = [name for name in (*ARRAYS, "json") if name not in arrays]
    if missing:
        kind = "a truth of cylinders" if {"s", "e", "r"} <= set(arrays) else "another archive"
        msg = f"{path}: is {kind}, not a model (no {', '.join(missing)}); give the .npz of a tree"
        raise InputFormatError(msg)
    try:
        known = from_json(arrays["json"].tobytes().decode("ascii"))
        held = _members(known)
        skeleton = Skeleton(arrays["xyz"], arrays["parent"], arrays["origin"], known["crs"], held[0])
        return TreeModel(
            skeleton,
            arrays["radius"],
            arrays["radius_source"],
            arrays["radius_rmse"],
            trunk_from_plain(known["trunk"]),
            held[1],
        )
    except (ModelError, ValueError, TypeError, KeyError) as error:
        msg = f"{path}: its arrays make no tree ({error}); write it anew from its source"
        raise InputFormatError(msg) from error


def _members(known: Any) -> tuple[Mapping[str, Any], Mapping[str, Any]]:
    if not isinstance(known, Mapping) or known.get("format") != "treepipe-model":
        msg = "its JSON does not say treepipe-model"
        raise ModelError(msg)
    return known["skeleton"], known["metadata"]


def _arrays(path: str | os.PathLike[str]) -> dict[str, NDArray[Any]]:
    try:
        with Path(path).open("rb") as file:
            archive = np.load(file, allow_pickle=False)
            if not isinstance(archive, np.lib.npyio.NpzFile):
                msg = "it is a single array"
                raise ModelError(msg)
            return {name: archive[name] for name in archive.files}
    except (FileNotFoundError, IsADirectoryError) as error:
        msg = f"{path}: there is no such file; check the name"
        raise InputMissingError(msg) from error
    except (OSError, ValueError, EOFError, MemoryError, zipfile.BadZipFile, zlib.error) as error:
        msg = f"{path}: is not an archive of arrays ({error}); give the .npz of a tree"
        raise InputFormatError(msg) from error
