"""The stem of a sparse cloud: robust circles one above the other, each predicted by those below."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.compiled import compiled
from pipeline.geometry.smoothing import falling, whittaker
from pipeline.skeleton.rings import (
    EMPTY,
    INLIER,
    LEAST_ARC,
    LEAST_POINTS,
    THINNEST,
    first_circle,
    next_circle,
    tally,
)

__all__ = ["LEAST_POINTS", "SLAB_M", "STEP_M", "Stem", "find_stem"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

FIRST_SLAB_M = 1.5  # height of the slabs in which the first circle is sought
SEARCHED = 0.5  # share of the height up to which it is sought
SOUGHT_POINTS = 90  # points of a slab that circles are laid through, three by three
WANTED = 20  # points that a slab on the way up should hold
SLAB_M = (0.4, 1.5)  # least and largest height of such a slab
CONTRAST = 8.0  # least density of points on the bark against that around it; random points reach 4
LOST_M = 2.0  # the stem ends where no circle is found for so long
LEAST_CIRCLES = 3  # fewer are chance
WIDEST = 0.04  # largest radius as a share of the height, beside WIDEST_M
WIDEST_M = 0.15
STOUT = (1.2, 0.4)  # a radius is less than 1.2 of the first, times the share of height left to the 0.4
STEP_M = 0.1  # nodes of the stem
LEAST_STEP_M = 0.01  # a foot nearer to the ground than this stands on it
SURE_M = 2.0  # length over which the lowest direction is taken, and down which it holds
ERROR = 1.3  # a radius' standard error in noises over the root of its points; the centre is unknown too
OUT_OF_ROUND = 0.02  # share of the radius that even a perfect scan leaves open
MICROMETRE = 6


@dataclass(frozen=True, eq=False)
class Stem:
    """The lower axis of a tree.

    Parameters
    ----------
    xyz : (M, 3) array
        Nodes from the foot up, metres.
    radius : (M,) array
        Metres; 0 where the stem was not seen.
    noise : float
        Robust standard deviation of the points about their circles, metres.
    circles : tuple of (float, float, float)
        Height, radius and its standard error of every circle, from below, metres; none where no
        bark was seen.
    """

    xyz: Floats
    radius: Floats
    noise: float
    circles: tuple[tuple[float, float, float], ...]

    def off_bark(self, xyz: Floats) -> tuple[NDArray[np.bool_], Floats, Floats]:
        """(P,) whether points lie past the end, how far off the bark, and the radius there."""
        at, share, away = _nearest_on(xyz, self.xyz)
        radius = self.radius[at] + share * (self.radius[at + 1] - self.radius[at])
        return (at == len(self.xyz) - 2) & (share >= 1.0), away - radius, radius

    def claims(self, xyz: Floats) -> NDArray[np.bool_]:
        """(P,) points on the stem's bark or inside it."""
        if not self.circles:
            return np.zeros(len(xyz), dtype=bool)
        past, off, _ = self.off_bark(xyz)
        return np.asarray((off <= INLIER * self.noise) & ~past)


def find_stem(xyz: Floats, ground_z: float, noise_m: float) -> Stem | None:
    """Follow the stem up from its foot by robust circles.

    Parameters
    ----------
    xyz : (P, 3) array
        Points in canonical order, metres.
    ground_z : float
        Where the stem's foot stands, metres.
    noise_m : float
        What to expect of the points' noise, metres.

    Returns
    -------
    Stem or None
        None where no bark is found.
    """
    top = float(xyz[:, 2].max())
    widest = WIDEST * (top - ground_z) + WIDEST_M
    low = float(xyz[:, 2].min())
    while low < ground_z + SEARCHED * (top - ground_z):
        slab = xyz[(xyz[:, 2] >= low) & (xyz[:, 2] < low + FIRST_SLAB_M)]
        if len(slab) >= LEAST_POINTS:
            stride = 1 + (len(slab) - 1) // SOUGHT_POINTS
            a, b, r, _ = first_circle(slab, np.ascontiguousarray(slab[::stride]), noise_m, widest)
            if r > 0.0:
                circles = _follow(xyz, np.array([a, b, low + FIRST_SLAB_M / 2]), r, noise_m)
                stem = _clear_part(xyz, circles[np.argsort(circles[:, 2], kind="stable")], ground_z)
                if stem is not None:
                    return stem
        low += FIRST_SLAB_M / 2
    return None


def _follow(xyz: Floats, centre: Floats, radius: float, noise: float) -> Floats:
    """(K, 6) centre, radius, points and misfit of the circles from the first one up and down."""
    density = _bark_density(xyz, centre, radius, noise)
    up = _walk(xyz, centre, (radius, density, noise), 1.0)
    down = _walk(xyz, centre, (radius, density, noise), -1.0)
    return np.vstack([down[::-1], up])


def _bark_density(xyz: Floats, centre: Floats, radius: float, noise: float) -> float:
    away = np.linalg.norm(xyz[:, :2] - centre[:2], axis=1)
    near = (np.abs(away - radius) < INLIER * noise) & (np.abs(xyz[:, 2] - centre[2]) < FIRST_SLAB_M / 2)
    return max(int(np.count_nonzero(near)), 1) / (2.0 * np.pi * radius * FIRST_SLAB_M)


def _clear_part(xyz: Floats, circles: Floats, ground_z: float) -> Stem | None:
    """Return the stem up to where its bark stands out from the points around it."""
    while len(circles) >= LEAST_CIRCLES:
        stem = _stem_of(circles, ground_z)
        if _contrast(stem, xyz[(xyz[:, 2] >= circles[0, 2]) & (xyz[:, 2] <= circles[-1, 2])]) >= CONTRAST:
            return stem
        circles = circles[: int(0.8 * len(circles))]
    return None


def _contrast(stem: Stem, xyz: Floats) -> float:
    """Density of points on the bark against that around it, up to two radii."""
    _, off, radius = stem.off_bark(xyz)
    reach, middle = INLIER * stem.noise, float(np.median(stem.radius))
    bark = np.count_nonzero(np.abs(off) < reach)
    around = 1 + np.count_nonzero((off >= reach) & (off < radius + reach))
    outer, inner = middle + reach, max(middle - reach, 0.0)
    return float(bark / (outer**2 - inner**2) * ((2.0 * middle + reach) ** 2 - outer**2) / around)


def _stem_of(circles: Floats, ground_z: float) -> Stem:
    """Smooth the circles into an axis with a falling radius, and lead it down to the ground."""
    noise = float(np.median(circles[:, 5]))
    height = np.arange(circles[0, 2], circles[-1, 2] + STEP_M, STEP_M)
    weight = np.maximum(circles[:, 4], 1.0)
    bare = np.sqrt(np.maximum(circles[:, 3] ** 2 - noise**2, (0.5 * circles[:, 3]) ** 2))
    radius = falling(bare, weight)
    axis = whittaker(np.ascontiguousarray(circles[:, :2]), weight, 2.0 * float(np.median(weight)))
    xyz = np.column_stack([*(np.interp(height, circles[:, 2], axis[:, k]) for k in (0, 1)), height])
    wide = np.interp(height, circles[:, 2], radius)
    if height[0] > ground_z + LEAST_STEP_M:
        foot = _foot(xyz, ground_z)
        xyz, wide = np.vstack([foot, xyz]), np.concatenate([np.full(len(foot), wide[0]), wide])
    error = np.hypot(ERROR * noise / np.sqrt(weight), OUT_OF_ROUND * bare)
    rows = np.round(np.column_stack([circles[:, 2], bare, error]), MICROMETRE).tolist()
    return Stem(xyz, wide, noise, tuple((z, r, e) for z, r, e in rows))


def _foot(xyz: Floats, ground_z: float) -> Floats:
    """Nodes below the lowest circle, along the direction of the lowest metres."""
    ahead = min(int(SURE_M / STEP_M), len(xyz) - 1)
    way = xyz[ahead] - xyz[0]
    depth = xyz[0, 2] - ground_z
    lean = way[:2] / max(way[2], 1e-9) * min(1.0, SURE_M / depth)  # far below, straight down is likelier
    below = np.linspace(-depth, 0.0, int(np.ceil(depth / STEP_M)) + 1)[:-1]
    return np.column_stack([xyz[0, :2] + below[:, None] * lean, xyz[0, 2] + below])


@compiled
def _nearest_on(xyz: Floats, line: Floats) -> tuple[Ints, Floats, Floats]:
    """Segment of the polyline nearest to every point, share along it, distance."""
    at = np.zeros(len(xyz), dtype=np.int64)
    share, away = np.zeros(len(xyz)), np.full(len(xyz), np.inf)
    for s in range(len(line) - 1):
        ax, ay, az = line[s + 1, 0] - line[s, 0], line[s + 1, 1] - line[s, 1], line[s + 1, 2] - line[s, 2]
        square = max(ax * ax + ay * ay + az * az, 1e-12)
        for i in range(len(xyz)):
            x, y, z = xyz[i, 0] - line[s, 0], xyz[i, 1] - line[s, 1], xyz[i, 2] - line[s, 2]
            t = min(max((x * ax + y * ay + z * az) / square, 0.0), 1.0)
            x, y, z = x - t * ax, y - t * ay, z - t * az
            d = np.sqrt(x * x + y * y + z * z)
            if d < away[i]:
                at[i], share[i], away[i] = s, t, d
    return at, share, away


@compiled
def _walk(xyz: Floats, centre: Floats, known: tuple[float, float, float], sense: float) -> Floats:
    """Circles from the first one on, upwards (sense 1) or downwards (-1)."""
    first_radius, density, noise = known
    out = np.empty((1000, 6))
    count, lost = 0, 0.0
    here, radius, lean = centre.copy(), first_radius, np.zeros(2)
    top = xyz[:, 2].max()
    edge = top if sense > 0.0 else xyz[:, 2].min()
    while lost < LOST_M and count < 1000:
        height = min(max(WANTED / (2.0 * np.pi * radius * density), SLAB_M[0]), SLAB_M[1])
        if count > 0 or sense < 0.0 or lost > 0.0:
            radius *= max(top - here[2] - 0.5 * height * sense, 0.0) / max(top - here[2], 1e-9)
            here[:2] += lean * 0.5 * height * sense
            here[2] += 0.5 * height * sense
        if (here[2] - edge) * sense > 0.0 or radius < THINNEST * noise:
            break
        slab = _around(xyz, here, lean, height, 2.0 * radius + 5.0 * noise)
        a, b, r = next_circle(slab, radius, noise)
        on, inside, arc, misfit = tally(slab, (a, b, r), noise)
        left = float(max(top - here[2], 0.0)) / float(max(top - centre[2], 1e-9))
        clear = r <= STOUT[0] * first_radius * left ** STOUT[1]
        if not (clear and on >= LEAST_POINTS - 2 and arc >= LEAST_ARC and inside <= EMPTY * on + 1.0):
            lost += 0.5 * height
            continue
        here[0], here[1] = here[0] + a, here[1] + b
        out[count] = np.array([here[0], here[1], here[2], r, float(on), misfit])
        count, lost = count + 1, 0.0
        radius = 0.6 * radius + 0.4 * r
        lean = _lean(out[:count], lean, sense)
    return out[:count]


@compiled
def _around(xyz: Floats, here: Floats, lean: Floats, height: float, reach: float) -> Floats:
    """Points of a slab, in plan relative to the leaning axis through `here`."""
    out = np.empty((len(xyz), 2))
    count = 0
    for i in range(len(xyz)):
        up = xyz[i, 2] - here[2]
        if abs(up) > 0.5 * height:
            continue
        x, y = xyz[i, 0] - here[0] - lean[0] * up, xyz[i, 1] - here[1] - lean[1] * up
        if x * x + y * y <= reach * reach:
            out[count, 0], out[count, 1] = x, y
            count += 1
    return out[:count]


@compiled
def _lean(circles: Floats, before: Floats, sense: float) -> Floats:
    """Horizontal run per metre of height over the last circles, held towards the one before."""
    count = len(circles)
    low = max(count - 6, 0)
    rise = (circles[count - 1, 2] - circles[low, 2]) * sense
    if rise < 0.5:
        return before
    last = circles[low:count]
    z = last[:, 2] - last[:, 2].mean()
    hold = 0.3 * (z * z).sum()
    x = (z * (last[:, 0] - last[:, 0].mean())).sum() + hold * before[0]
    y = (z * (last[:, 1] - last[:, 1].mean())).sum() + hold * before[1]
    square = (z * z).sum() + hold
    return np.array([x / square, y / square])
