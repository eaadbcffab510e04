"""The truth beside a synthetic cloud: a chain of cylinders in the cloud's own coordinates."""

from __future__ import annotations

import os
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import InputFormatError, InputMissingError
from pipeline.model import Floats, TreeModel
from pipeline.output import whole_file

KEYS = ("s", "e", "r", "order", "branch", "parent")


@dataclass(frozen=True, eq=False)
class Truth:
    """Cylinders of a known tree, parents first.

    Parameters
    ----------
    s, e : (M, 3) array of float64
        Ends of each axis in metres, in the coordinates of the cloud.
    r : (M,) array of float64
        Radius in metres.
    order, branch, parent : (M,) array of int64
        Branch order (0 is the stem), branch number, and the cylinder it grows from (-1 at the foot).
    """

    s: Floats
    e: Floats
    r: Floats
    order: NDArray[np.int64]
    branch: NDArray[np.int64]
    parent: NDArray[np.int64]

    @property
    def volume_m3(self) -> float:
        """Summed volume of the cylinders."""
        return float(np.pi * (self.r**2 * np.linalg.norm(self.e - self.s, axis=1)).sum())


def truth_of(tree: TreeModel) -> Truth:
    """Turn every segment of a tree into a cylinder of its mean radius."""
    skeleton = tree.skeleton
    parent = skeleton.parent[1:]
    return Truth(
        s=skeleton.world[parent],
        e=skeleton.world[1:],
        r=(tree.start_radius[1:] + tree.radius[1:]) / 2,
        order=skeleton.order[1:].astype(np.int64),
        branch=skeleton.branch[1:].astype(np.int64),
        parent=parent.astype(np.int64) - 1,
    )


def write_truth(truth: Truth, path: str | os.PathLike[str]) -> None:
    """Write a truth as compressed .npz; the same truth gives the same bytes.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    with whole_file(path) as temporary, temporary.open("wb") as stream:
        np.savez_compressed(stream, **{key: getattr(truth, key) for key in KEYS})


def read_truth(path: str | os.PathLike[str]) -> Truth:
    """Read what `write_truth` wrote.

    Raises
    ------
    InputMissingError
        If there is no such file.
    InputFormatError
        If it is no .npz, or an array is missing or of another length.
    """
    source = Path(path)
    if not source.is_file():
        msg = f"{source}: no such file; give a .truth.npz"
        raise InputMissingError(msg)
    try:
        with source.open("rb") as stream, np.load(stream) as arrays:
            held = {key: arrays[key] for key in KEYS}
    except (OSError, EOFError, ValueError, TypeError, KeyError, zipfile.BadZipFile) as error:
        msg = f"{source}: is no truth ({error}); it needs the arrays {', '.join(KEYS)}"
        raise InputFormatError(msg) from error
    count = len(held["r"])
    wrong = [key for key in KEYS if held[key].shape != ((count, 3) if key in {"s", "e"} else (count,))]
    if wrong:
        shape = held[wrong[0]].shape
        msg = f"{source}: {wrong[0]} has shape {shape} beside {count} radii; write the truth anew"
        raise InputFormatError(msg)
    return Truth(**held)
