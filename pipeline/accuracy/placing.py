"""Whether two trees can be compared where they stand, and moving one on to the other."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pipeline.accuracy.wood import Wood
from pipeline.errors import PipelineError

Floats = NDArray[np.float64]
Box = tuple[Floats, Floats]
Align = Literal["root", "none"]

FAR_M = 1000.0
"""Things so far apart are not the same tree, nor a wrong shift of it."""


SAME_M = 0.001
"""Roots so close are one: no format of ours rounds more."""


class NotComparableError(PipelineError, ValueError):
    """Two trees, or a tree and a cloud, that have nothing to do with each other where they stand."""


def check_wood(wood: Wood, name: str) -> None:
    """Make sure that a tree has an axis.

    Raises
    ------
    NotComparableError
        If it has none.
    """
    if not len(wood) or not wood.length.sum() > 0:
        msg = f"{name} is empty: it has no segment with a length; give a model of a tree"
        raise NotComparableError(msg)


def shift_of(a: Wood, b: Wood, align: Align) -> Floats:
    """Return what has to be added to A so that both can be compared.

    Parameters
    ----------
    a, b : Wood
    align : {"root", "none"}
        Whether A is moved so that it stands where B stands.

    Raises
    ------
    NotComparableError
        If nothing is to be moved, and they are in different reference systems or kilometres apart.
    """
    if align == "root":
        return np.asarray(b.root - a.root)
    if not same_system(a.crs, b.crs):
        msg = f"A is in {a.crs} and B in {b.crs}; convert one of them, or lay their roots together with "
        raise NotComparableError(msg + "--align root")
    apart = gap(a.box, b.box)
    if apart > FAR_M:
        msg = f"A and B are {apart / 1000:.1f} km apart; give models in the same coordinates, or lay their "
        raise NotComparableError(msg + "roots together with --align root")
    return np.zeros(3)


def placing_notes(a: Wood, b: Wood, *, movable: bool) -> tuple[str, ...]:
    """Return a sentence where two trees lie apart, or do not stand on the same spot.

    Parameters
    ----------
    a, b : Wood
    movable : bool
        Whether A could be moved on to B.
    """
    apart, step = gap(a.box, b.box), float(np.linalg.norm(b.root - a.root))
    remedy = "; --align root lays their roots together" if movable else ""
    if apart > 0:
        return (f"A and B do not overlap, {apart:.2f} m lie between them{remedy}",)
    if movable and step > SAME_M:
        return (f"the roots of A and B are {step:.3f} m apart{remedy}",)
    return ()


def gap(a: Box, b: Box) -> float:
    """Return the distance between two boxes in metres; 0 where they overlap."""
    return float(np.linalg.norm(np.maximum(np.maximum(a[0] - b[1], b[0] - a[1]), 0.0)))


def same_system(a: str | None, b: str | None) -> bool:
    """Tell whether coordinates in two systems can be compared; an unknown one goes with any.

    Systems that differ in what their heights refer to alone (EPSG:28992 and EPSG:7415) count as the same.
    """
    if a is None or b is None or a == b:
        return True
    from pyproj import CRS  # noqa: PLC0415 (slow to import, and seldom needed)
    from pyproj.exceptions import CRSError  # noqa: PLC0415

    try:
        plan_a, plan_b = (next(iter(CRS(name).sub_crs_list), CRS(name)).to_2d() for name in (a, b))
    except CRSError:
        return False
    return bool(plan_a == plan_b)
