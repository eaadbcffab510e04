"""Draw trees with and without each operation, as the figures of the thesis do, and measure over 30 seeds.

    python -m tests.benchmarks.pruning_figures OUT [--measure]

writes one PNG a figure: 4.3, 4.5, 4.6, 4.8, 4.9 and 4.11 to 4.13 of growth and pruning, 5.1 to 5.3 of the
evaluation, and one of the operations that it has not. ``--measure`` prints the figures of docs/pruning.md.
"""

from __future__ import annotations

import argparse
import copy
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from PIL import Image

from pipeline.growth import Event, Growth, GrowthOptions, Metamers, grow
from pipeline.growth.events import planned
from pipeline.growth.pruning import (
    BendAndTie,
    CrownRaise,
    Espalier,
    FacingBud,
    LimitLength,
    OpenCentre,
    Operation,
    Outward,
    Reduce,
    Stake,
    Thin,
)
from pipeline.growth.pruning.facing import facing_bud, outward
from pipeline.growth.pruning.operation import leader

DEFAULT = GrowthOptions()
DPI = 80
BARK, LEADER, STAKE, GROUND = "#6b4226", "#b5651d", "#3a8f3a", "#b9b09a"
SEEDS = range(30)
DOWN = np.array([0.0, 0.0, -1.0])
Panel = tuple[str, Growth]


def main() -> None:
    """Draw everything, or what was named."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--measure", action="store_true", help="also print the figures over 30 seeds")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    for draw in (growth_models, stake, open_centre, espalier, dominance, facing, others):
        draw(given.out)
    if given.measure:
        for measure in (measure_stake, measure_open, measure_facing, measure_espalier, measure_thin):
            measure()


def tree(years: int, seed: int, *events: Event, **options: Any) -> Growth:
    """Grow a tree."""
    return grow(DEFAULT.model_copy(update=options), years, seed=seed, events=events)


def growth_models(out: Path) -> None:
    """Figures 4.3, 4.5, 4.6, 4.8 and 4.9: space, cordons, dominance, priority, drooping."""
    space = {"light": "space"}
    cordon = planned(Stake(direction=(1, 0, 1)), 0)
    panels(out / "fig_4_3.png", [("free space", tree(16, 1, **space))])
    panels(
        out / "fig_4_5.png",
        [("cordon, space", tree(14, 1, *cordon, **space)), ("cordon, shadow", tree(14, 1, *cordon))],
        stakes=[(1.0, 0.0, 1.0)] * 2,
    )
    panels(out / "fig_4_6.png", [(f"lambda {v}", tree(20, 1, dominance=v)) for v in (0.50, 0.54)])
    priority = {"allocation": "priority", "switch_year": 8}
    panels(out / "fig_4_8.png", [("priority, then Borchert-Honda", tree(22, 1, **priority))])
    panels(
        out / "fig_4_9.png", [("vertical pull falls", tree(22, 1, vertical_weight=0.3, vertical_fall=0.04))]
    )


def stake(out: Path) -> None:
    """Figures 4.11 and 5.1: the stem beside its stake."""
    seed = max(SEEDS, key=lambda s: deviation(tree(18, s)))  # many stems are straight as it is
    free, tied = tree(18, seed), tree(18, seed, *planned(Stake(), 0))
    panels(out / "fig_4_11.png", [("alone", free), ("staked", tied)], stakes=[None, (0.0, 0.0, 1.0)])
    figure = Figure(figsize=(6, 3.2), layout="constrained")
    axes = figure.subplots()
    for name, one, colour in (("alone", free, BARK), ("staked", tied, STAKE)):
        stem = one.metamers.end[one.metamers.axis(0)]
        axes.plot(np.arange(len(stem)), 100 * np.hypot(stem[:, 0], stem[:, 1]), color=colour, label=name)
    axes.set(xlabel="metamer of the stem", ylabel="distance from a plumb line, cm")
    axes.legend(frameon=False)
    save(figure, out / "fig_5_1.png")


def open_centre(out: Path) -> None:
    """Figure 4.12: cut at year 10, and the trees at 25 years."""
    once, again = planned(OpenCentre(), 10), planned(OpenCentre(), 10, until=25, every=2)
    panels(
        out / "fig_4_12.png",
        [
            ("year 10", tree(10, 0)),
            ("cut", tree(10, 0, *once)),
            ("year 25, alone", tree(25, 0)),
            ("year 25, cut once", tree(25, 0, *once)),
            ("year 25, cut level", tree(25, 0, *planned(OpenCentre(level=True), 10))),
            ("year 25, kept open", tree(25, 0, *again)),
        ],
    )


def espalier(out: Path) -> None:
    """Figure 4.13: an espalier through the years."""
    training = planned(Espalier(), 1, until=20)
    panels(
        out / "fig_4_13.png",
        [(f"year {year}", tree(year, 0, *training[:year])) for year in (5, 8, 12, 20)],
    )


def dominance(out: Path) -> None:
    """Figure 5.2: the end shoot cut in year 8, and year 19 with and without."""
    cut = planned(OpenCentre(leaders=4), 8)
    panels(
        out / "fig_5_2.png",
        [("year 8", tree(8, 2)), ("year 19, alone", tree(19, 2)), ("year 19, cut in 8", tree(19, 2, *cut))],
    )


def facing(out: Path) -> None:
    """Figure 5.3: a branch alone, and cut to a bud that looks down."""
    growths = [tree(10, 0) for _ in range(2)]
    branch, key = branch_and_bud(growths[0], lambda *_: DOWN)
    tip = tuple(growths[0].metamers.end[growths[0].metamers.axis(branch)[-1]])
    base = int(growths[0].metamers.key[branch])
    FacingBud(position=tip, within_m=0.01).apply(growths[1])
    for one in growths:
        one.grow_year()
        one.grow_year()
    figure = Figure(figsize=(8, 3.4), layout="constrained")
    both = figure.subplots(1, 2, sharex=True, sharey=True)
    for axes, one, name in zip(both, growths, ("alone", "cut to a bud that looks down"), strict=True):
        start, bud = (int(np.flatnonzero(one.metamers.held()["key"] == k)[0]) for k in (base, key))
        path = leader(one.metamers, start)
        way = one.metamers.end[path[-1]] - one.metamers.begin[start]
        part = one.metamers.subtree([start])
        draw_wood(axes, one.metamers, part, view=np.arctan2(way[1], way[0]), scale=220)
        place = one.metamers.end[bud]
        across = np.array([np.cos(np.arctan2(way[1], way[0])), np.sin(np.arctan2(way[1], way[0]))])
        axes.plot(place[:2] @ across, place[2], "o", color=STAKE, ms=5)
        axes.set_title(name, fontsize=10)
        axes.set_aspect("equal")
        axes.autoscale_view()
    save(figure, out / "fig_5_3.png")


def others(out: Path) -> None:
    """What the thesis has not: crowns raised, thinned, reduced; branches limited and bent."""
    grown = tree(20, 3)
    shown: list[Panel] = [("alone", grown)]
    operations: tuple[tuple[str, Operation], ...] = (
        ("crown-raise 1.5 m", CrownRaise(height_m=1.5)),
        ("thin 30 %", Thin(share=0.3)),
        ("reduce", Reduce(width_m=2.2, height_m=3.6)),
        ("limit-length 0.8 m", LimitLength(length_m=0.8)),
        ("bend-and-tie", BendAndTie(order=1, lowest_m=1.4, highest_m=3.0)),
    )
    for name, operation in operations:
        one = copy.deepcopy(grown)
        operation.apply(one)
        shown.append((name, one))
    panels(out / "others.png", shown)


def panels(path: Path, shown: Sequence[Panel], stakes: Sequence[Any] | None = None) -> None:
    """Draw trees side by side at one scale, seen from -y."""
    high = max(float(one.metamers.held()["end"][:, 2].max()) for _, one in shown)
    wide = [max(float(np.abs(one.metamers.held()["end"][:, 0]).max()), 0.25 * high) for _, one in shown]
    figure = Figure(figsize=(4.6 * sum(2 * w for w in wide) / high + 0.2, 4.9), layout="constrained")
    ratios = {"width_ratios": wide}
    row = np.atleast_1d(figure.subplots(1, len(shown), sharey=True, gridspec_kw=ratios))
    for i, ((title, one), axes) in enumerate(zip(shown, row, strict=True)):
        axes.axhline(0.0, color=GROUND, lw=1.5, zorder=0)
        if stakes and stakes[i] is not None:
            x, _, z = np.array(stakes[i]) / max(np.abs(stakes[i])) * high
            axes.plot([0.0, x], [0.0, z], color=STAKE, lw=2.0, alpha=0.6, zorder=0)
        draw_wood(axes, one.metamers, np.ones(len(one.metamers), dtype=bool), view=0.0, scale=300 / high)
        axes.set(xlim=(-1.05 * wide[i], 1.05 * wide[i]), ylim=(-0.02 * high, 1.03 * high), aspect="equal")
        axes.set_title(title, fontsize=10)
        axes.axis("off")
    save(figure, path)


def save(figure: Figure, path: Path) -> None:
    """Write a PNG of few colours, which is small."""
    figure.savefig(path, dpi=DPI)
    with Image.open(path) as image:
        few = image.convert("RGB").quantize(24)
    few.save(path, optimize=True)


def draw_wood(axes: Any, metamers: Metamers, part: Any, *, view: float, scale: float) -> None:
    """Draw metamers as lines as wide as they are; `scale` in points for a metre."""
    held = metamers.held()
    across = np.array([np.cos(view), np.sin(view)])
    a, b = (
        np.column_stack([held[end][part][:, :2] @ across, held[end][part][:, 2]]) for end in ("begin", "end")
    )
    stem = np.isin(np.flatnonzero(part), leader(metamers))
    width = np.maximum(held["width"][part] * scale, 0.6)
    order = np.argsort(stem, kind="stable")
    lines = LineCollection(
        list(np.stack([a, b], axis=1)[order]),
        linewidths=width[order],
        colors=[LEADER if on else BARK for on in stem[order]],
        capstyle="round",
    )
    axes.add_collection(lines)


def branch_and_bud(growth: Growth, way: Callable[[Metamers, int], Any]) -> tuple[int, int]:
    """Return the longest branch of the stem, and the key of the bud to which it is cut."""
    known = growth.metamers
    starts = [int(known.lateral_child[i]) for i in known.axis(0) if known.lateral_child[i] >= 0]
    branch = max(starts, key=lambda start: (len(known.axis(start)), -start))
    bud = facing_bud(known, branch, way(known, branch))
    return branch, int(known.key[bud])


def measure_stake() -> None:
    """Print how far stems are from a plumb line at 14 years, of those that are not straight anyhow."""
    for light in ("shadow", "space"):
        ways = ((), planned(Stake(), 0))
        both = np.array([[deviation(tree(14, s, *way, light=light)) for way in ways] for s in SEEDS])
        both = both[both[:, 0] > 0.001]
        halved = (both[:, 1] <= both[:, 0] / 2).mean()
        print(
            f"stake, {light}: {len(both)} stems, mean {both.mean(axis=0).round(4)} m, halved in {halved:.0%}"
        )


def deviation(growth: Growth) -> float:
    """Mean distance of the stem's metamers from a plumb line through the foot, metres."""
    stem = growth.metamers.end[growth.metamers.axis(0)]
    return float(np.hypot(stem[:, 0], stem[:, 1]).mean())


def measure_open() -> None:
    """Print height, and width over height, at 25 years."""
    ways: dict[str, tuple[Event, ...]] = {
        "alone": (),
        "once": planned(OpenCentre(), 10),
        "once, level": planned(OpenCentre(level=True), 10),
        "kept open": planned(OpenCentre(), 10, until=25, every=2),
    }
    alone = np.zeros(len(SEEDS))
    for name, events in ways.items():
        size = np.array([extent(tree(25, s, *events).metamers.held()["end"]) for s in SEEDS])
        ratio = size[:, 0] / size[:, 1]
        alone = ratio if name == "alone" else alone
        print(
            f"open-centre, {name}: height {size[:, 1].mean():.2f} m, width {size[:, 0].mean():.2f} m, "
            f"width/height {ratio.mean():.3f}, more than alone in {100 * (ratio > alone).mean():.0f} %"
        )


def extent(points: np.ndarray) -> tuple[float, float]:
    """Greatest width in plan, whichever way it lies, and height, metres."""
    turn = np.radians(np.arange(0.0, 180.0, 5.0))
    across = points[:, :2] @ np.stack([np.cos(turn), np.sin(turn)])
    return float(np.ptp(across, axis=0).max()), float(np.ptp(points[:, 2]))


def measure_facing() -> None:
    """Print by how many degrees branches of 10- and 12-year trees turn, three metamers after the cut."""
    for name, operation, way in (("facing-bud", FacingBud, lambda *_: DOWN), ("outward", Outward, outward)):
        for years in (10, 12):
            gain = np.array([turned(years, seed, operation, way) for seed in SEEDS])
            share = (gain > 0).mean()
            print(f"{name}, year {years}: mean {gain.mean():.1f} degrees, gained in {share:.0%}")


def turned(years: int, seed: int, operation: Any, way: Callable[[Metamers, int], Any]) -> float:
    """By how many degrees a branch comes nearer to a direction."""
    growths = [tree(years, seed) for _ in range(2)]
    known = growths[0].metamers
    branch, key = branch_and_bud(growths[0], way)
    towards = way(known, branch)
    operation(position=tuple(known.end[known.axis(branch)[-1]]), within_m=0.01).apply(growths[1])
    angles = []
    for one in growths:
        for _ in range(3):
            one.grow_year()
        path = leader(one.metamers, int(np.flatnonzero(one.metamers.held()["key"] == key)[0]))
        step = one.metamers.end[path[3]] - one.metamers.end[path[0]]
        angles.append(np.degrees(np.arccos(np.clip(step @ towards / np.linalg.norm(step), -1.0, 1.0))))
    return float(angles[0] - angles[1])


def measure_espalier() -> None:
    """Print what espaliers of three tiers are like at year 15, and whether they are the same in year 20."""
    steep, same, counts = [], [], []
    for seed in SEEDS:
        growth, seen = tree(0, seed), {}
        for year in range(1, 21):
            growth.grow_year()
            Espalier().apply(growth)
            seen[year] = {
                int(growth.metamers.key[arm]): growth.metamers.end[growth.metamers.axis(arm)[-1]]
                - growth.metamers.begin[arm]
                for arm, _ in Espalier()._arms(growth.metamers)
            }
        counts.append(len(seen[15]))
        steep += [np.degrees(np.arcsin(way[2] / np.linalg.norm(way))) for way in seen[15].values()]
        same.append(all(np.linalg.norm(seen[20][arm] - way) < 0.05 for arm, way in seen[15].items()))
    print(
        f"espalier: arms {set(counts)}, slope {min(steep):.1f} to {max(steep):.1f}, same {np.mean(same):.0%}"
    )


def measure_thin() -> None:
    """Print what thinning a fifth takes, and by how much the light of the buds left rises."""
    gone, more = [], []
    for seed in SEEDS:
        one = tree(16, seed)
        count = len(one.metamers) - 1
        light = dict(
            zip(one.metamers.held()["key"].tolist(), one.light.at_buds(one.metamers).terminal, strict=True)
        )
        gone.append(Thin(share=0.2).apply(one).removed / count)
        before = np.mean([light[key] for key in one.metamers.held()["key"].tolist()])
        more.append(one.light.at_buds(one.metamers).terminal.mean() / before - 1.0)
    print(f"thin: {np.mean(gone):.1%} of the metamers, light of the rest {np.mean(more):+.1%}")


if __name__ == "__main__":
    main()
