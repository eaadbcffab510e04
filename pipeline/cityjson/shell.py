"""Does a shell of surfaces enclose a solid? Every edge once in each direction, no surface flat."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.cityjson.finding import Finding
from pipeline.model import Floats

PLANAR_M = 0.01
"""A corner may stand this far out of its surface's plane (as val3dity allows)."""

Index = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Surfaces:
    """Polygons with holes as flat arrays.

    Parameters
    ----------
    corner : (C,) array of int64
        Vertex of every corner, ring after ring.
    following : (C,) array of int64
        Position of the next corner in the same ring.
    surface : (C,) array of int64
        Surface of every corner.
    count : int
        Number of surfaces.
    points : (V, 3) array of float64
        Vertices of the document, metres.
    """

    corner: Index
    following: Index
    surface: Index
    count: int
    points: Floats

    @classmethod
    def of(cls, boundaries: list[Any], points: Floats) -> Surfaces:
        """Flatten a list of surfaces (each a list of rings)."""
        rings = list(chain.from_iterable(boundaries))
        size = np.array([len(ring) for ring in rings], dtype=np.int64)
        end = np.cumsum(size)
        following = np.arange(1, int(size.sum()) + 1)
        following[end - 1] = end - size
        of_ring = np.repeat(np.arange(len(boundaries)), [len(rings) for rings in boundaries])
        corner = np.fromiter(chain.from_iterable(rings), dtype=np.int64, count=int(size.sum()))
        return cls(corner, following, np.repeat(of_ring, size), len(boundaries), points)

    @cached_property
    def normal(self) -> Floats:
        """(S, 3) normals, as long as the area of the surface (Newell's sum)."""
        here = self.points[self.corner] - self.points[self.corner[self.head]][self.surface]
        cross = np.cross(here, here[self.following])
        return np.column_stack([np.bincount(self.surface, cross[:, k], self.count) for k in range(3)]) / 2

    @cached_property
    def head(self) -> Index:
        """(S,) position of the first corner of each surface."""
        return np.searchsorted(self.surface, np.arange(self.count))

    @cached_property
    def volume(self) -> float:
        """Signed volume inside the surfaces; positive where they face outward."""
        arm = self.points[self.corner[self.head]] - self.points[self.corner[0]]
        return float(np.einsum("ij,ij->", arm, self.normal) / 3)


def surface_findings(surfaces: Surfaces, where: str, step: float) -> Iterator[Finding]:
    """Find surfaces that are no proper polygons: too few corners, a corner twice, flat, not planar.

    Parameters
    ----------
    surfaces : Surfaces
    where : str
        Name of what they belong to.
    step : float
        Step of the coordinates in metres; a surface narrower than half of it has no area.

    Yields
    ------
    Finding
        One for each kind, naming the first surface and how many there are.
    """
    repeated = _repeated_corners(surfaces)
    flat_, bent = _flat_and_bent(surfaces, step)
    flat_ = np.setdiff1d(flat_, repeated)
    same = _same_surface(surfaces)
    yield from _first(
        repeated,
        where,
        "names a vertex twice or has fewer than three.",
        "Remove it and close the gap it leaves.",
    )
    yield from _first(
        flat_, where, "has no area.", "Merge its corners, or remove it and close the gap it leaves."
    )
    yield from _first(same, where, "has the same corners as an earlier one.", "Remove one of the two.")
    yield from _first(
        bent, where, f"is not planar: a corner stands more than {PLANAR_M} m out.", "Split it into triangles."
    )


def shell_findings(surfaces: Surfaces, where: str, *, hollow: bool = False) -> Iterator[Finding]:
    """Find what keeps a shell from enclosing a solid.

    Parameters
    ----------
    surfaces : Surfaces
    where : str
    hollow : bool, optional
        True for an inner shell, whose surfaces face into the hollow.

    Yields
    ------
    Finding
        Surfaces that face the wrong way, edges of one surface only, edges of more than two, or a
        shell that is inside out.
    """
    start, end = surfaces.corner, surfaces.corner[surfaces.following]
    span = int(surfaces.corner.max()) + 1
    key, back = start * span + end, end * span + start
    known, times = np.unique(key, return_counts=True)
    along = times[np.searchsorted(known, key)]
    place = np.minimum(np.searchsorted(known, back), len(known) - 1)
    against = np.where(known[place] == back, times[place], 0)
    twice = (along > 1) | (against > 1)
    if not twice.any() and (against == 1).all():
        if (surfaces.volume > 0) == hollow or surfaces.volume == 0:
            yield Finding(
                where,
                f"The shell encloses {surfaces.volume:.3g} m3: its surfaces face the wrong way.",
                "Reverse the corners of every surface, so that they run counter-clockwise seen from outside.",
            )
        return
    wrong = np.flatnonzero(
        np.bincount(surfaces.surface, twice & (against == 0), surfaces.count)
        == np.bincount(surfaces.surface, minlength=surfaces.count)
    )
    if len(wrong):
        yield from _first(wrong, where, "faces the other way than its neighbours.", "Reverse its corners.")
        twice &= ~_edges_of(wrong, surfaces, key, back)
    lonely = (along == 1) & (against == 0)
    if lonely.any():
        yield _edge(
            lonely, surfaces, where, "belongs to this surface only: the shell is open, a surface is missing."
        )
    if twice.any():
        yield _edge(
            twice, surfaces, where, "belongs to more than two surfaces, or to two in the same direction."
        )


def _edges_of(wrong: Index, surfaces: Surfaces, key: Index, back: Index) -> NDArray[np.bool_]:
    """Tell which edges lie on one of the wrong surfaces or run the same way beside it."""
    mine = np.isin(surfaces.surface, wrong)
    return np.isin(key, key[mine]) | np.isin(key, back[mine])


def _edge(found: NDArray[np.bool_], surfaces: Surfaces, where: str, says: str) -> Finding:
    at = int(np.flatnonzero(found)[0])
    a, b = surfaces.corner[at], surfaces.corner[surfaces.following[at]]
    more = f" ({found.sum()} such edges)" if found.sum() > 1 else ""
    return Finding(
        f"{where}, surface {surfaces.surface[at]}",
        f"The edge from vertex {a} to {b} {says[:-1]}{more}.",
        "Give every edge exactly two surfaces that run along it in opposite directions.",
    )


def _first(found: Index, where: str, says: str, remedy: str) -> Iterator[Finding]:
    if len(found):
        more = f" ({len(found)} such surfaces)" if len(found) > 1 else ""
        yield Finding(f"{where}, surface {found[0]}", f"The surface {says[:-1]}{more}.", remedy)


def _repeated_corners(surfaces: Surfaces) -> Index:
    """Return the surfaces with a vertex that comes twice, or with fewer than three corners."""
    span = int(surfaces.corner.max()) + 1
    known, times = np.unique(surfaces.surface * span + surfaces.corner, return_counts=True)
    few = np.bincount(surfaces.surface, minlength=surfaces.count) < 3
    few[known[times > 1] // span] = True
    return np.flatnonzero(few)


def _flat_and_bent(surfaces: Surfaces, step: float) -> tuple[Index, Index]:
    """Return the surfaces without area, and those with a corner out of their plane."""
    here = surfaces.points[surfaces.corner]
    edge = np.linalg.norm(here[surfaces.following] - here, axis=1)
    longest = np.zeros(surfaces.count)
    np.maximum.at(longest, surfaces.surface, edge)
    area = np.linalg.norm(surfaces.normal, axis=1)
    flat_ = 2 * area < step / 2 * longest
    flat_ |= longest == 0
    unit = surfaces.normal / np.where(area > 0, area, 1)[:, None]
    out = np.abs(np.einsum("ij,ij->i", here - here[surfaces.head][surfaces.surface], unit[surfaces.surface]))
    bent = np.unique(surfaces.surface[out > PLANAR_M])
    return np.flatnonzero(flat_), np.setdiff1d(bent, np.flatnonzero(flat_))


def _same_surface(surfaces: Surfaces) -> Index:
    """Return the surfaces whose corners are those of an earlier one, in whatever order."""
    order = np.lexsort([surfaces.corner, surfaces.surface])
    corner = surfaces.corner[order].tolist()
    bounds = [*surfaces.head.tolist(), len(corner)]
    seen: set[tuple[int, ...]] = set()
    same = []
    for number in range(surfaces.count):
        corners = tuple(corner[bounds[number] : bounds[number + 1]])
        if corners in seen:
            same.append(number)
        seen.add(corners)
    return np.array(same, dtype=np.int64)
