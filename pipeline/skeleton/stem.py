"""The stem of a sparse cloud: robust circles one above the other, each predicted by those below."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.compiled import compiled
from pipeline.geometry.smoothing import falling, whittaker

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Circle = tuple[float, float, float, float]  # centre (two), radius, score

INLIER = 2.5  # noises within which a point is on the bark
FIRST_SLAB_M = 1.5  # height of the slabs in which the first circle is sought
SEARCHED = 0.5  # share of the height up to which it is sought
SOUGHT_POINTS = 90  # points of a slab that circles are laid through, three by three
WANTED = 20  # points that a slab on the way up should hold
SLAB_M = (0.4, 1.5)  # least and largest height of such a slab
LEAST_POINTS = 7  # on the bark of a slab
LEAST_ARC = 0.4  # share of the circle's sectors that hold bark
SECTORS = 8
EMPTY = 0.2  # most points inside a circle, as a share of those on it
CONTRAST = 8.0  # least density of points on the bark against that around it; random points reach 4
LOST_M = 2.0  # the stem ends where no circle is found for so long
LEAST_CIRCLES = 3  # fewer are chance
WIDEST = 0.04  # largest radius as a share of the height, beside WIDEST_M
WIDEST_M = 0.15
STOUT = (1.2, 0.4)  # a radius is less than 1.2 of the first, times the share of height left to the 0.4
THINNEST = 1.5  # noises below which a radius cannot be seen
STEP_M = 0.1  # nodes of the stem
LEAST_STEP_M = 0.01  # a foot nearer to the ground than this stands on it
SURE_M = 2.0  # length over which the lowest direction is taken, and down which it holds
ERROR = 1.3  # a radius' standard error in noises over the root of its points; the centre is unknown too
OUT_OF_ROUND = 0.02  # share of the radius that even a perfect scan leaves open
MICROMETRE = 6
TINY = 1e-9  # square metres by which rounding might mistake a place for another


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
            a, b, r, _ = _first_circle(slab, np.ascontiguousarray(slab[::stride]), noise_m, widest)
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
def _first_circle(slab: Floats, chosen: Floats, noise: float, widest: float) -> Circle:
    """Vote among all circles through three points; radius 0 where none has bark enough."""
    best = (0.0, 0.0, 0.0, 0.0)
    beside, reach = 4.0 * widest**2, (2.0 * widest + 2.0 * INLIER * noise) ** 2
    for i in range(len(chosen)):
        x, y, later = chosen[i, 0], chosen[i, 1], chosen[i + 1 :]
        near = slab[(slab[:, 0] - x) ** 2 + (slab[:, 1] - y) ** 2 <= reach]  # no circle's points lie beyond
        others = later[(later[:, 0] - x) ** 2 + (later[:, 1] - y) ** 2 <= beside]
        for j in range(len(others)):
            for k in range(j + 1, len(others)):
                a, b, r = _through(chosen[i], others[j], others[k])
                if r < 2.0 * THINNEST * noise or r > widest:
                    continue
                score = _score(near, (a, b, r), noise)
                if score > best[3]:
                    best = (a, b, r, score)
    if best[3] > 0.0:
        a, b, r = _refine(slab, best[:3], noise, best[:3], 10.0)
        if _is_bark(slab, (a, b, r), noise):
            return a, b, r, best[3]
    return 0.0, 0.0, 0.0, 0.0


@compiled
def _through(p: Floats, q: Floats, s: Floats) -> tuple[float, float, float]:
    """Circle through three points, in plan; radius 0 where they lie on a line."""
    bx, by, cx, cy = q[0] - p[0], q[1] - p[1], s[0] - p[0], s[1] - p[1]
    d = 2.0 * (bx * cy - by * cx)
    if abs(d) < 1e-9:
        return 0.0, 0.0, 0.0
    x = (cy * (bx * bx + by * by) - by * (cx * cx + cy * cy)) / d
    y = (bx * (cx * cx + cy * cy) - cx * (bx * bx + by * by)) / d
    return p[0] + x, p[1] + y, np.sqrt(x * x + y * y)


@compiled
def _score(points: Floats, circle: tuple[float, float, float], noise: float) -> float:
    """Bark on the circle, less what lies inside it; near misses count in part."""
    a, b, r = circle
    total, reach = 0.0, INLIER * noise
    outside, inside = (r + reach) ** 2 + TINY, max(r - reach, 0.0) ** 2 - TINY
    for i in range(len(points)):
        x, y = points[i, 0] - a, points[i, 1] - b
        square = x * x + y * y
        if square > outside:
            continue
        if square < inside:
            total -= 1.0
            continue
        off = (np.sqrt(square) - r) / reach
        if abs(off) < 1.0:
            total += (1.0 - off * off) ** 2
        elif off < 0.0:
            total -= 1.0
    return total


@compiled
def _refine(
    points: Floats,
    start: tuple[float, float, float],
    noise: float,
    prior: tuple[float, float, float],
    loose: float,
) -> tuple[float, float, float]:
    """Least squares on the points near the circle (Tukey's weights), drawn to `prior`.

    `loose` is the prior's standard deviation, in radii.
    """
    a, b, r = start
    for _ in range(12):
        lhs, rhs = np.zeros((3, 3)), np.zeros(3)
        hold = (noise / (loose * prior[2])) ** 2
        goal = (prior[0] - a, prior[1] - b, prior[2] - r)
        for k in range(3):
            lhs[k, k], rhs[k] = hold, hold * goal[k]
        for i in range(len(points)):
            x, y = points[i, 0] - a, points[i, 1] - b
            away = np.sqrt(x * x + y * y)
            off = away - r
            u = off / (2.0 * INLIER * noise)
            if abs(u) >= 1.0 or away < 1e-9:
                continue
            w = (1.0 - u * u) ** 2
            row = np.array([x / away, y / away, 1.0])
            for k in range(3):
                rhs[k] += w * row[k] * off
                for m in range(3):
                    lhs[k, m] += w * row[k] * row[m]
        step = np.linalg.solve(lhs, rhs)
        a, b, r = a + step[0], b + step[1], max(r + step[2], 0.5 * noise)
    return a, b, r


@compiled
def _is_bark(points: Floats, circle: tuple[float, float, float], noise: float) -> bool:
    """Whether enough points lie on the circle, all round enough, and few inside."""
    on, inside, arc, _ = _tally(points, circle, noise)
    return on >= LEAST_POINTS and arc >= LEAST_ARC and inside <= EMPTY * on


@compiled
def _tally(points: Floats, circle: tuple[float, float, float], noise: float) -> tuple[int, int, float, float]:
    """Points on and inside the circle, share of the sectors with bark, robust misfit."""
    a, b, r = circle
    seen = np.zeros(SECTORS)
    off = np.empty(len(points))
    on, inside = 0, 0
    for i in range(len(points)):
        x, y = points[i, 0] - a, points[i, 1] - b
        away = np.sqrt(x * x + y * y) - r
        if abs(away) < INLIER * noise:
            seen[int((np.arctan2(y, x) + np.pi) / (2.0 * np.pi) * SECTORS) % SECTORS] = 1.0
            off[on] = abs(away)
            on += 1
        elif away < 0.0:
            inside += 1
    misfit = 1.4826 * float(np.median(off[:on])) if on else np.inf
    return on, inside, float(seen.mean()), misfit


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
        a, b, r = _next_circle(slab, radius, noise)
        on, inside, arc, misfit = _tally(slab, (a, b, r), noise)
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
def _next_circle(slab: Floats, radius: float, noise: float) -> tuple[float, float, float]:
    """Vote over centres and radii about the predicted circle, then refine."""
    best, most = (0.0, 0.0, radius), -np.inf
    for k in range(-3, 4):
        r = radius * (1.0 + 0.08 * k)
        for i in range(-4, 5):
            for j in range(-4, 5):
                a, b = 0.15 * i * radius, 0.15 * j * radius
                value = _score(slab, (a, b, r), noise)
                value -= 1.5 * (a * a + b * b) / (0.4 * radius) ** 2 + 0.5 * ((r / radius - 1.0) / 0.15) ** 2
                if value > most:
                    best, most = (a, b, r), value
    return _refine(slab, best, noise, (best[0], best[1], radius), 0.3)


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
