"""The truth beside a synthetic cloud: a chain of cylinders in the cloud's own coordinates."""

from __future__ import annotations

import os
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import InputFormatError, InputMissingError, ModelError
from pipeline.model import MEASURED, Floats, Skeleton, TreeModel
from pipeline.output import whole_file

SNAP_M = 0.0005
"""A branch that starts this near to the end of a cylinder starts at its end."""
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


def tree_of(truth: Truth) -> TreeModel:
    """Turn a chain of cylinders into a tree that can be drawn and scanned.

    Where a branch starts in the middle of a cylinder, a node is put there. Between two cylinders of
    a branch the radius is their mean, so that `truth_of` gives the radii back to within the taper of
    one cylinder.

    Parameters
    ----------
    truth : Truth
        Parents first.

    Raises
    ------
    ModelError
        If the cylinders do not make one tree.
    """
    origin = np.floor(truth.s[0])
    xyz, above, radius = [truth.s[0] - origin], [-1], [float(truth.r[0])]
    node_at: dict[tuple[int, float], int] = {(-1, 1.0): 0}
    starts, tip_radius = _starts(truth), _tip_radii(truth)
    cuts: dict[int, set[float]] = {}
    for p, share in starts:
        cuts.setdefault(p, set()).add(share)
    for c, (p, share) in enumerate(starts):
        node = node_at[c, 0.0] = node_at[p, share]
        for at in sorted({1.0, *cuts.get(c, ())} - {0.0}):
            above.append(node)
            node = node_at[c, at] = len(xyz)
            xyz.append(truth.s[c] + at * (truth.e[c] - truth.s[c]) - origin)
            radius.append(float(truth.r[c] if at < 1 else tip_radius[c]))
    skeleton = Skeleton(np.array(xyz), np.array(above, dtype=np.int32), origin)
    count = len(xyz)
    return TreeModel(
        skeleton, np.array(radius), np.full(count, MEASURED, dtype=np.uint8), np.zeros(count), None, {}
    )


def _tip_radii(truth: Truth) -> Floats:
    """Return the radius at the end of every cylinder: the mean with the next one of its branch."""
    next_is_child = truth.parent[1:] == np.arange(len(truth.r) - 1)
    onward = np.append(next_is_child & (np.diff(truth.branch) == 0), False)
    return np.asarray(np.where(onward, (truth.r + np.roll(truth.r, -1)) / 2, truth.r))


def _starts(truth: Truth) -> list[tuple[int, float]]:
    """Return the parent of every cylinder, and the share of the parent's axis where it starts."""
    late = np.flatnonzero(truth.parent >= np.arange(len(truth.parent)))
    if len(late) or not len(truth.parent):
        msg = "the truth has no cylinder, or one before its parent; write it with parents first"
        raise ModelError(msg)
    p = np.maximum(truth.parent, 0)
    along = truth.e[p] - truth.s[p]
    square = np.maximum((along**2).sum(axis=1), 1e-12)
    share = np.clip(((truth.s - truth.s[p]) * along).sum(axis=1) / square, 0, 1)
    reach = np.sqrt(square)
    share = np.where(share * reach < SNAP_M, 0.0, np.where((1 - share) * reach < SNAP_M, 1.0, share))
    share[truth.parent < 0] = 1.0
    return list(zip(truth.parent.tolist(), share.tolist(), strict=True))


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


def holds_truth(path: str | os.PathLike[str]) -> bool:
    """Return whether a file is an .npz with the arrays of a truth."""
    try:
        with zipfile.ZipFile(path) as archive:
            return {f"{key}.npy" for key in KEYS} <= set(archive.namelist())
    except (OSError, zipfile.BadZipFile):
        return False
