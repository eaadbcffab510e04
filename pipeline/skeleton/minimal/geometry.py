"""Where a leaf's branch leaves its mother, and whether it may.

An axis is a straight piece from its base to its tip. A branch leaves it at a given insertion angle
(180 degrees less the bifurcation angle, which is taken to the mother's base).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.compiled import compiled

Floats = NDArray[np.float64]
Way = tuple[float, float, float, float]  # unit direction and length, metres

TOLERANCE_M = 1e-9  # of comparisons of lengths, so that rounding decides nothing


@compiled
def branch_point(
    leaf: Floats, base: Floats, tip: Floats, beyond: float, insertion: float
) -> tuple[float, float]:
    """Place a leaf's branch on a mother axis.

    With u the axis' direction, t the leaf's place along it and d its distance from its line, the
    branch leaves at ``s = t - d / tan(insertion)`` and is ``c = d / sin(insertion)`` long. It may,
    if s lies on the axis and c is at most what is left of the mother (apical dominance).

    Parameters
    ----------
    leaf, base, tip : (3,) arrays
        Metres.
    beyond : float
        Length by which the mother goes on past `tip`, metres; 0 for a branch.
    insertion : float
        Angle between the directions of the daughter and the mother, radians.

    Returns
    -------
    s, c : float
        Metres from the base along the axis, and the branch's length; c is inf where it may not.

    References
    ----------
    Beyer, Bayer, Pretzsch & Cournede (2017), "Reconstructing minimal length tree branch systems from
    leaf positions", Ecological Informatics 42, 61-66, section 2.1 and conditions (2) and (3).
    """
    return branch_on(leaf, base, direction(base, tip), beyond, turn(insertion), np.inf)


@compiled
def direction(base: Floats, tip: Floats) -> Way:
    """Unit direction of an axis, and its length; no direction and 0 where it has none."""
    x, y, z = tip[0] - base[0], tip[1] - base[1], tip[2] - base[2]
    size = np.sqrt(x * x + y * y + z * z)
    if size <= TOLERANCE_M:
        return 0.0, 0.0, 0.0, 0.0
    return x / size, y / size, z / size, size


@compiled
def turn(insertion: float) -> tuple[float, float]:
    """Cosine and sine of an insertion angle."""
    return np.cos(insertion), np.sin(insertion)


@compiled
def branch_on(
    leaf: Floats, base: Floats, way: Way, beyond: float, turned: tuple[float, float], most: float
) -> tuple[float, float]:
    """Place a branch as `branch_point` does, with what all leaves share at hand.

    Parameters
    ----------
    leaf, base : (3,) arrays
    way : tuple
        `direction` of the mother.
    beyond : float
    turned : tuple
        `turn` of the insertion angle.
    most : float
        A branch that is not shorter is not wanted: its length is inf.
    """
    x, y, z, size = way
    cosine, sine = turned
    if size == 0.0:
        return 0.0, np.inf
    a, b, c = leaf[0] - base[0], leaf[1] - base[1], leaf[2] - base[2]
    t = a * x + b * y + c * z
    a, b, c = a - t * x, b - t * y, c - t * z
    square = a * a + b * b + c * c
    if square > (most * sine) ** 2:
        return t, np.inf
    d = np.sqrt(square)
    s, length = t - d * cosine / sine, d / sine
    if s < -TOLERANCE_M or s > size + TOLERANCE_M or length > size - s + beyond + TOLERANCE_M:
        return s, np.inf
    return min(max(s, 0.0), size), length


@compiled
def nearest_place(leaf: Floats, base: Floats, tip: Floats) -> tuple[float, float]:
    """Nearest place on an axis: metres from its base, and the leaf's distance from there."""
    along, off = tip - base, leaf - base
    size = np.sqrt((along * along).sum())
    s = min(max((along * off).sum() / size, 0.0), size) if size > 0.0 else 0.0
    away = off - s * along / size if size > 0.0 else off
    return s, np.sqrt((away * away).sum())


@compiled
def place_on(base: Floats, tip: Floats, s: float) -> Floats:
    """(3,) the point `s` metres from the base towards the tip."""
    along = tip - base
    size = np.sqrt((along * along).sum())
    return base + along * (s / size if size > 0.0 else 0.0)
