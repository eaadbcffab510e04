"""How quickly trees grow: 25 years of the defaults by both models of light, and a great tree.

    python tests/benchmarks/growth.py [--great 100000] [--picture FILE.png]

`ms` is processor time, the least of five runs (of two for the great trees) with everything compiled; `made/s`
is the metamers that came in it, also those that were shed, in a second. The great tree is grown until it has
so many metamers, by space a tenth of them. The published figure is 642,000 internodes in 60 seconds
(Palubicki et al. 2009). `--picture` draws both trees through the years.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from pipeline.growth import Growth, GrowthOptions, Metamers  # noqa: E402 (the path comes first)

LIGHTS = ("shadow", "space")
AGES = (5, 10, 19, 25)
YEARS = 25
RUNS, GREAT_RUNS = 5, 2
GREAT_YEARS = 200


def through(light: str, years: int, most: int | None = None) -> tuple[Growth, int, float]:
    """Grow a tree; with it the metamers that came and the seconds of the processor."""
    growth = Growth(Metamers.one_bud(), GrowthOptions(light=light, most_metamers=5_000_000), seed=1)
    made, begin = 0, time.process_time()
    for _ in range(years):
        made += growth.grow_year().grown
        if most is not None and len(growth.metamers) > most:
            break
    return growth, made, time.process_time() - begin


def quickest(runs: int, light: str, years: int, most: int | None = None) -> tuple[Growth, int, float]:
    """Return the quickest of some runs of `through`."""
    return min((through(light, years, most) for _ in range(runs)), key=lambda run: run[2])


def row(what: str, light: str, growth: Growth, made: int, seconds: float) -> None:
    """Print a line of the table."""
    size = np.ptp(growth.metamers.held()["end"], axis=0)
    print(
        f"| {what} | {light} | {growth.year} | {len(growth.metamers) - 1:,} | {size[2]:.1f} | "
        f"{size[:2].max():.1f} | {1000 * seconds:,.0f} | {made / seconds:,.0f} |"
    )


def draw(path: Path) -> None:
    """Draw both trees at four ages, seen from the side."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 5.4))
    axes: Any = figure.subplots(len(LIGHTS), len(AGES), sharex=True, sharey=True)
    for line, light in zip(axes, LIGHTS, strict=True):
        for one, age in zip(line, AGES, strict=True):
            wood(one, through(light, age)[0].metamers)
            one.set_title(f"{light}, {age} years", fontsize=8)
    figure.tight_layout(pad=0.3)
    figure.savefig(path, dpi=80)


def wood(axes: Any, tree: Metamers) -> None:
    """Draw the metamers of a tree from the side, the thicker ones wider."""
    from matplotlib.collections import LineCollection

    held = tree.held()
    lines = np.stack([held["begin"][1:, [0, 2]], held["end"][1:, [0, 2]]], axis=1)
    wide = np.maximum(0.4, 45.0 * held["width"][1:])
    axes.add_collection(LineCollection(list(lines), linewidths=wide, colors="#3a2a1c"))
    axes.set(xlim=(-3.6, 3.6), ylim=(0.0, 6.4), aspect="equal")
    axes.axis("off")


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure, and draw if asked."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--great", type=int, default=100_000, help="metamers of the great tree; 0: none")
    parser.add_argument("--picture", type=Path, help="a PNG")
    given = parser.parse_args(arguments)
    print("| tree | light | years | metamers | m high | m wide | ms | made/s |")
    print("|---" * 8 + "|")
    for light in LIGHTS:
        through(light, YEARS // 2)
        row("default", light, *quickest(RUNS, light, YEARS))
    if given.great:
        row("great", "shadow", *quickest(GREAT_RUNS, "shadow", GREAT_YEARS, given.great))
        row("great", "space", *quickest(GREAT_RUNS, "space", GREAT_YEARS, given.great // 10))
    if given.picture:
        draw(given.picture)


if __name__ == "__main__":
    main()
