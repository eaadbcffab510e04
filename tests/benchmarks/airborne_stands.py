"""How well trees are parted in generated stands: 36 known trees in leaf, scanned from the air, segmented.

    python tests/benchmarks/airborne_stands.py OUT [--set smooth_cells=1.0]...

Four kinds of trees are grown and scanned alone (three of each; kept in OUT), then set in rows or at random,
turned, and scaled by 15 %; of what lies under a pulse of a grid the highest point counts, and now and then
one below it. A tree is found where its points and a true one's overlap by half (intersection over union).
Printed are precision, recall and F1 by stand, with the defaults and with each setting, and before them how
rough the crowns of a kind are, to set beside real ones. The stands served to set no default.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy import ndimage
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from pipeline.airborne.canopy import canopy  # noqa: E402  # the path comes first
from pipeline.airborne.raster import Grid  # noqa: E402
from pipeline.airborne.segmentation import SegmentationOptions, segment  # noqa: E402
from pipeline.model import PointCloud  # noqa: E402
from pipeline.synthetic import KINDS, SCANNERS, scan  # noqa: E402

SCALE = {
    ("organic", "excurrent"): 1.5,
    ("colonization", "excurrent"): 1.5,
    ("organic", "decurrent"): 1.5,
    ("colonization", "decurrent"): 1.0,
}
"""What the kinds are scaled by, to heights of 8 to 20 m."""

GROWN, DRAWN = "organic", "colonization"
STANDS = {
    "conifers": ((GROWN, DRAWN), ("excurrent",)),
    "broadleaves": ((GROWN, DRAWN), ("decurrent",)),
    "in clumps": ((GROWN,), ("decurrent",)),
    "smooth": ((DRAWN,), ("decurrent",)),
    "mixed": ((GROWN, DRAWN), ("excurrent", "decurrent")),
}
"""Growers and habits. Broadleaves are grown in clumps, rather too many, or drawn as domes, too smooth."""

SPACINGS = ((0.8, True), (0.8, False), (1.1, False))
"""In crown widths, and whether in rows."""

CELL_M = 0.5
SIDE = 6
PULSES_PER_M2, BEAM_M, DEEPER_M, THROUGH = 20.0, 0.15, 0.5, 0.35
GROUND_STEP_M, MARGIN_M = 0.35, 6.0
ORIGIN = np.array([121000.0, 487000.0, 0.0])


class Stand(NamedTuple):
    """A cloud, the number of the tree of each of its first points, and their mean spacing in metres."""

    cloud: PointCloud
    owner: np.ndarray
    spacing_m: float


def library(out: Path) -> dict[tuple[str, str, int], np.ndarray]:
    """Points of every tree about its foot, grown and scanned once."""
    out.mkdir(parents=True, exist_ok=True)
    found = {}
    for kind, habit in SCALE:
        for seed in (1, 2, 3):
            file = out / f"{kind}_{habit}_{seed}.npy"
            if not file.is_file():
                grower = KINDS[kind]
                tree = grower.grow(grower.options(**{**grower.preset(habit), "seed": seed}))
                options = SCANNERS["als"](density_per_m2=60, leaves=True, seed=seed)
                cloud = scan(tree, options=options).cloud
                xyz = cloud.xyz + cloud.origin - tree.skeleton.world[0]
                np.save(file, xyz[xyz[:, 2] > 0.5])
            found[kind, habit, seed] = np.load(file)
    return found


def from_above(xyz: np.ndarray, seed: int) -> np.ndarray:
    """Indices of what pulses on a shaken grid return: the highest point, sometimes lower ones as well."""
    rng, step = np.random.default_rng(seed), PULSES_PER_M2**-0.5
    low, high = xyz[:, :2].min(axis=0), xyz[:, :2].max(axis=0)
    axes = [np.arange(a, b, step) for a, b in zip(low, high, strict=True)]
    pulses = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
    pulses = pulses + rng.uniform(-0.5, 0.5, pulses.shape) * step
    hit = []
    for near in cKDTree(xyz[:, :2]).query_ball_point(pulses, BEAM_M):
        below = np.array(near, dtype=int)
        while len(below):
            top = below[np.argmax(xyz[below, 2])]
            hit.append(top)
            below = below[xyz[below, 2] < xyz[top, 2] - DEEPER_M]
            if rng.random() > THROUGH:
                break
    return np.unique(hit)


def relief(xyz: np.ndarray) -> tuple[float, float]:
    """Roughness of a crown 1.5 m and more from its edge: metres about a quadric, and tops on 100 m2.

    `xyz` is above the ground; cells and smoothing are those of the segmentation.
    """
    grid = Grid.over(xyz, np.zeros(3), CELL_M)
    top = canopy(xyz[:, 2], grid.cells(xyz), grid, SegmentationOptions().smooth_cells)
    solid = ndimage.binary_closing(np.pad(top > 0, 4), iterations=2)[3:-3, 3:-3]
    inner = (ndimage.distance_transform_edt(solid)[1:-1, 1:-1] * CELL_M > 1.5) & (top > 0)
    x, y = (axis - axis.mean() for axis in np.nonzero(inner))
    terms = np.column_stack([np.ones(len(x)), x, y, x * x, x * y, y * y])
    off = top[inner] - terms @ np.linalg.lstsq(terms, top[inner], rcond=None)[0]
    tops = (ndimage.maximum_filter(top, size=3) == top) & inner
    return float(off.std()), float(100 * tops.sum() / (inner.sum() * CELL_M**2))


def stand_of(trees: dict, which: tuple, gap: float, *, rows: bool, seed: int = 11) -> Stand:
    """Plant a stand and fly over it."""
    rng = np.random.default_rng(seed)
    growers, habits = which
    names = [name for name in trees if name[0] in growers and name[1] in habits]
    picks = [names[rng.integers(len(names))] for _ in range(SIDE * SIDE)]
    width = np.mean([np.ptp(trees[name][:, :2], axis=0).mean() * SCALE[name[:2]] for name in picks])
    planted = []
    for number, name in enumerate(picks):
        size, turn = SCALE[name[:2]] * np.exp(rng.normal(0, 0.15)), rng.uniform(0, 2 * np.pi)
        rotation = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
        off = rng.normal(0, 0.05, 2) if rows else rng.uniform(-0.3, 0.3, 2)
        place = (np.array(divmod(number, SIDE)) + off) * gap * width
        xyz = trees[name] * size
        planted.append(np.column_stack([xyz[:, :2] @ rotation + place, xyz[:, 2]]))
    xyz = np.concatenate(planted) + rng.normal(0, 0.02, (sum(map(len, planted)), 3))
    owner = np.repeat(np.arange(len(planted)), [len(points) for points in planted])
    seen = from_above(xyz, seed)
    return Stand(_with_ground(xyz[seen], rng), owner[seen], float(gap * width))


def _with_ground(xyz: np.ndarray, rng: np.random.Generator) -> PointCloud:
    low = np.floor(xyz[:, :2].min(axis=0) - MARGIN_M)
    high = xyz[:, :2].max(axis=0) + MARGIN_M
    axes = [np.arange(a, b, GROUND_STEP_M) for a, b in zip(low, high, strict=True)]
    ground = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
    ground = np.column_stack([ground, rng.normal(0, 0.03, len(ground))])
    every = np.concatenate([xyz, ground]) - [*low, 0.0]
    told = {
        "classification": np.repeat([5, 2], [len(xyz), len(ground)]).astype(np.uint8),
        "return_number": np.ones(len(every), dtype=np.uint8),
    }
    return PointCloud(np.rint(every * 4096) / 4096, ORIGIN, attributes=told)


def found(stand: Stand, options: SegmentationOptions) -> tuple[float, float, float]:
    """Precision, recall and F1."""
    trees, count = segment(stand.cloud, options=options).trees, SIDE * SIDE
    of_trees = (tree.points[tree.points < len(stand.owner)] for tree in trees)
    shared = np.array([np.bincount(stand.owner[points], minlength=count) for points in of_trees])
    whole = shared.sum(axis=1)[:, None] + np.bincount(stand.owner, minlength=count) - shared
    overlap = shared / whole
    right = (overlap[linear_sum_assignment(-overlap)] >= 0.5).sum()
    return right / len(trees), right / count, 2 * right / (len(trees) + count)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("out", type=Path)
    parser.add_argument("--set", action="append", default=[], metavar="KEY=NUMBER", dest="settings")
    chosen = parser.parse_args()
    trees = library(chosen.out)
    for name, xyz in trees.items():
        seen = xyz[from_above(xyz * SCALE[name[:2]], 1)] * SCALE[name[:2]]
        rough, tops = relief(seen)
        print(f"{' '.join(map(str, name)):25} relief {rough:.2f} m, {tops:3.0f} tops on 100 m2")
    settings = [{}, *(dict([one.split("=")]) for one in chosen.settings)]
    for name, which in STANDS.items():
        for gap, rows in SPACINGS:
            stand = stand_of(trees, which, gap, rows=rows)
            for setting in settings:
                figures = found(stand, SegmentationOptions(**{k: float(v) for k, v in setting.items()}))
                told = "  ".join(
                    f"{key} {value:.2f}" for key, value in zip(("P", "R", "F1"), figures, strict=True)
                )
                layout = "rows" if rows else "random"
                print(f"{name:12} {layout:7} {stand.spacing_m:5.1f} m  {told}  {setting or ''}", flush=True)


if __name__ == "__main__":
    main()
