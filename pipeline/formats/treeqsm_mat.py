"""Trees as TreeQSM saves them from MATLAB: the ``cylinder`` of a structure in a .mat file, read only.

Files of MATLAB 5 to 7.2 need nothing more; version 7.3 is HDF5 and needs h5py, which the extra
``matlab`` brings. Radii are metres, rows count from 1.

References
----------
Raumonen, P. et al. (2013). Fast automatic precision tree models from terrestrial laser scanner data.
Remote Sensing 5. https://github.com/InverseTampere/TreeQSM
"""

from __future__ import annotations

import importlib
import io
import os
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import InputFormatError, MissingExtraError
from pipeline.formats.cylinders import Cylinders, tree_of
from pipeline.formats.lines import FAR, Row, read_bytes
from pipeline.formats.matfile import variables
from pipeline.formats.treeqsm import of_columns
from pipeline.model import Floats, TreeModel

KIND = "a .mat of TreeQSM"

HDF5 = b"\x89HDF\r\n\x1a\n"
"""First bytes of HDF5, at 0 or, in .mat files, at 512."""

SINGLE = ("radius", "length", "parent", "branch")
TRIPLE = ("start", "axis")


def read(path: str | os.PathLike[str]) -> TreeModel:
    """Read the one model of a file.

    Parameters
    ----------
    path : path-like

    Returns
    -------
    TreeModel
        Its origin is the foot of the tree in whole metres; see `pipeline.formats.cylinders.tree_of` for
        the gaps that TreeQSM leaves between cylinders.

    Raises
    ------
    InputMissingError
        If there is no such file.
    InputFormatError
        If it is no .mat file, or holds no model of TreeQSM, several of them, or one that is no tree.
    MissingExtraError
        If it is of version 7.3 and h5py is absent.
    """
    return tree_of(read_cylinders(path))


def read_cylinders(path: str | os.PathLike[str]) -> Cylinders:
    """Read the cylinders as they stand in the file, with its gaps; raises what `read` raises."""
    content = read_bytes(path, KIND)
    is_hdf5 = HDF5 in (content[:8], content[512:520])
    found = list(_in_hdf5(path, content) if is_hdf5 else _in_mat5(path, content))
    if len(found) != 1:
        holds = f"holds {len(found)} models" if found else "holds no structure with a cylinder"
        msg = f"{path}: {holds}; save one QSM of TreeQSM a file"
        raise InputFormatError(msg)
    columns = _columns(path, found[0])
    rows = [Row(f"row {k} of its cylinder", ()) for k in range(1, len(columns["radius"]) + 1)]
    return of_columns(path, rows, columns)


def _columns(path: str | os.PathLike[str], cylinder: Mapping[str, Any]) -> dict[str, Floats]:
    """Return the columns of a model by the names of the text table, checked for shape and numbers."""
    missing = [name for name in (*SINGLE, *TRIPLE) if name not in cylinder]
    if missing:
        msg = f"{path}: its cylinder lacks {', '.join(missing)}; save the QSM anew with TreeQSM 2.3 or later"
        raise InputFormatError(msg)
    count = np.size(cylinder["radius"])
    columns: dict[str, Floats] = {}
    for name in SINGLE:
        columns[name] = _numbers(path, cylinder[name], name, (count,))
    for name in TRIPLE:
        table = _numbers(path, cylinder[name], name, (count, 3))
        columns |= {f"{name} {axis}": table[:, k] for k, axis in enumerate("xyz")}
    if not count:
        msg = f"{path}: its cylinder is empty; save a QSM with a cylinder"
        raise InputFormatError(msg)
    return columns


def _numbers(path: str | os.PathLike[str], values: Any, name: str, shape: tuple[int, ...]) -> Floats:
    try:
        array = np.asarray(values, dtype=np.float64).reshape(shape)
    except (TypeError, ValueError) as error:
        msg = f"{path}: its cylinder.{name} is no array of shape {shape} ({error}); save the QSM anew"
        raise InputFormatError(msg) from error
    wrong = np.argwhere(~(np.abs(array) < FAR))
    if len(wrong):
        msg = f"{path}: its cylinder.{name} is not finite in row {wrong[0][0] + 1}; mend it"
        raise InputFormatError(msg)
    return array


def _in_mat5(path: str | os.PathLike[str], content: bytes) -> Iterator[Mapping[str, Any]]:
    """Yield the cylinders of every model in a file of MATLAB 5 to 7.2."""
    try:
        for value in variables(content):
            yield from _in_value(value)
    except ValueError as error:
        msg = f"{path}: is no .mat file or a damaged one ({error}); save the QSM anew from MATLAB"
        raise InputFormatError(msg) from error


def _in_value(value: Any) -> Iterator[Mapping[str, Any]]:
    """Yield the cylinders in a variable: structures with one, or structures that are one."""
    for inner in value if isinstance(value, list) else ():
        if not isinstance(inner, dict):
            yield from _in_value(inner)
        elif "axis" in inner:
            yield inner
        else:
            yield from _in_value(inner.get("cylinder"))


def _in_hdf5(path: str | os.PathLike[str], content: bytes) -> list[Mapping[str, Any]]:
    """Return the cylinders of every model in a file of MATLAB 7.3, whose arrays are transposed."""
    try:
        h5py = importlib.import_module("h5py")
    except ImportError as error:
        msg = f"{path}: is of MATLAB 7.3, which needs h5py; pip install 'treepipe[matlab]', or save with -v7"
        raise MissingExtraError(msg) from error
    found: list[Mapping[str, Any]] = []

    def visit(_name: str, item: Any) -> None:
        if isinstance(item, h5py.Group) and {"radius", "axis", "start"} <= set(item):
            found.append({key: _values(h5py, item[key]) for key in (*SINGLE, *TRIPLE) if key in item})

    try:
        with h5py.File(io.BytesIO(content), "r") as file:
            file.visititems(visit)
    except (OSError, ValueError, TypeError, KeyError, RuntimeError) as error:
        msg = f"{path}: is a damaged .mat file ({error}); save the QSM anew from MATLAB"
        raise InputFormatError(msg) from error
    return found


def _values(h5py: Any, item: Any) -> NDArray[Any]:
    """Return a dataset as MATLAB shows it."""
    if not isinstance(item, h5py.Dataset) or item.dtype == object:
        return np.empty(0)
    return np.asarray(item[()]).T
