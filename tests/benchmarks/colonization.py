"""How long trees take to grow into free space, beside the table of the thesis behind the generator.

    python tests/benchmarks/colonization.py

Each time is the least of five on one core, warm, in milliseconds: `grow` is points, stem and nodes, `shape`
radii, axes and bends, `leaves` their places. The last two trees have the points and iterations of table 1 of
the thesis, and eight times as many points.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))
LARGE = {"density_begin": 0.3, "crown_width_m": 6.2, "crown_height_m": 7.2, "crown_depth_m": 5.6}
HUGE = {"density_begin": 0.3, "crown_width_m": 12.5, "crown_height_m": 14.5, "crown_depth_m": 11.0}
TABLE_1 = {
    "Euclidean distance": (49.3, 45.1, 27.7, 22.2),
    "squared distance": (39.2, 37.2, 22.3, 17.7),
    "binary search": (20.5, 20.4, 11.4, 8.5),
    "voxel grid": (10.8, 11.0, 8.7, 3.4),
}
"""Seconds: simple, deleting points, bounding nodes, both; 25,000 points and 40 iterations."""


def least_ms(work: Callable[[], object]) -> float:
    """Time the quickest of five runs after one to warm up."""
    work()
    seconds = []
    for _ in range(5):
        start = time.perf_counter()
        work()
        seconds.append(time.perf_counter() - start)
    return 1000 * min(seconds)


def main() -> None:
    """Print both tables."""
    from pipeline.synthetic.colonization import PRESETS, ColonizationOptions, grow, leaves_of, shaped

    trees = {"default": {}, **{name: dict(PRESETS[name]) for name in PRESETS}}
    trees |= {
        "25,000 points, 40": {**LARGE, "iterations": 40},
        "200,000 points, 50": {**HUGE, "iterations": 50},
    }
    print(f"{'tree':20}{'points':>8}{'nodes':>7}{'grow':>7}{'shape':>7}{'leaves':>7}  stop")
    for name, changes in trees.items():
        options = ColonizationOptions(**changes)
        colony, stem = grow(options)
        tree = shaped(colony, stem, options)
        times = [
            least_ms(lambda o=options: grow(o)),
            least_ms(lambda c=colony, s=stem, o=options: shaped(c, s, o)),
            least_ms(lambda t=tree, o=options: leaves_of(t, o)),
        ]
        cells = "".join(f"{ms:7.0f}" for ms in times)
        print(f"{name:20}{len(colony.left):8}{len(tree):7}{cells}  {colony.reason}")
    print("\nseconds in table 1 of the thesis: simple, deleting, bounding, both")
    for name, seconds in TABLE_1.items():
        print(f"{name:20}" + "".join(f"{value:7.1f}" for value in seconds))


if __name__ == "__main__":
    main()
