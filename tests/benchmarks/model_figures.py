"""Draw what the thesis takes from others, figures 4.4, 4.7 and 4.10, with this model, and 4.11 seen closer.

python -m tests.benchmarks.model_figures OUT
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from pipeline.growth.events import planned
from pipeline.growth.pruning import Stake
from tests.benchmarks.pruning_figures import BARK, DEFAULT, SEEDS, STAKE, deviation, panels, save, tree


def main() -> None:
    """Draw everything."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    out = parser.parse_args().out
    out.mkdir(parents=True, exist_ok=True)
    shadow(out / "fig_4_4.png")
    weights(out / "fig_4_7_weights.png")
    shown = [("Borchert-Honda", tree(15, 1)), ("priority", tree(15, 1, allocation="priority"))]
    panels(out / "fig_4_7.png", shown)
    crooked(out / "fig_4_10.png")
    stems(out / "fig_4_11_stems.png")


def shadow(path: Path) -> None:
    """Figure 4.4: the pyramid of shade below a metamer, cut through its middle."""
    layers = DEFAULT.shade_layers
    shade = np.zeros((layers + 1, 2 * layers + 3))
    for q in range(layers + 1):
        shade[q, layers + 1 - q : layers + 2 + q] = DEFAULT.shade * DEFAULT.shade_fall**-q
    figure = Figure(figsize=(5.5, 3.2), layout="constrained")
    axes = figure.subplots()
    axes.imshow(shade, cmap="Greys", vmin=0.0, vmax=1.2 * DEFAULT.shade)
    for (q, i), value in np.ndenumerate(shade):
        if value:
            ink = "white" if value == shade.max() else "black"
            axes.text(i, q, f"{value:.3f}", ha="center", va="center", fontsize=6.5, color=ink)
    axes.plot(layers + 1, 0, "o", color=STAKE, ms=16, mfc="none")
    axes.set(xticks=[], yticks=range(layers + 1), ylabel="voxels below the bud")
    save(figure, path)


def weights(path: Path) -> None:
    """Figure 4.7c: the weight of a branch by its rank, of the priority model."""
    kappa, most, least = DEFAULT.priority_fall, DEFAULT.priority_most, DEFAULT.priority_least
    figure = Figure(figsize=(4.5, 2.8), layout="constrained")
    axes = figure.subplots()
    axes.plot([0.0, kappa, 1.0], [most, least, least], color=BARK)
    axes.set(xlabel="rank, as a share of the branches of an axis", ylabel="weight")
    save(figure, path)


def crooked(path: Path) -> None:
    """Figure 4.10: the most crooked tree by free space, and what a stake makes of it."""
    space = {"light": "space"}
    seed = max(SEEDS, key=lambda s: deviation(tree(14, s, **space)))
    shown = [("alone", tree(14, seed, **space)), ("staked", tree(14, seed, *planned(Stake(), 0), **space))]
    panels(path, shown, stakes=[(0.0, 0.0, 1.0)] * 2)


def stems(path: Path) -> None:
    """Figure 4.11: the stems of the most crooked tree by shadow, stretched sideways."""
    seed = max(SEEDS, key=lambda s: deviation(tree(18, s)))
    figure = Figure(figsize=(5.0, 4.2), layout="constrained")
    row = figure.subplots(1, 2, sharex=True, sharey=True)
    for axes, title, events in zip(row, ("alone", "staked"), ((), planned(Stake(), 0)), strict=True):
        one = tree(18, seed, *events).metamers
        stem = one.end[one.axis(0)]
        way = tree(18, seed).metamers
        far = way.end[way.axis(0)]
        far = far[np.argmax(np.hypot(far[:, 0], far[:, 1])), :2]
        axes.axvline(0.0, color=STAKE, lw=2.0, alpha=0.6)
        axes.plot(100 * stem[:, :2] @ far / np.linalg.norm(far), stem[:, 2], color=BARK, lw=3.0)
        axes.set(title=title, xlabel="from the plumb line, cm")
    row[0].set_ylabel("height, m")
    save(figure, path)


if __name__ == "__main__":
    main()
