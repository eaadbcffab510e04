"""What generalising and repeats save, and how far they move a tree: two twins of 2021, and tree1 of our own.

    python tests/benchmarks/generalise.py

Needs the shared clouds (TREEPIPE_DATA). Deviations are in cm, node to the same node, of all nodes and of the
averaged ones alone; `near` is the distance from an averaged node to the nearest point of the skeleton as it
was, which is nearer to what the report of 2021 measured: the distance between two meshes, of which its table
4.4 is printed beside. Seconds are the best of three, warm.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

REPORT = """2021, table 4.4 (tree1 of 6,669 nodes, its open loop; distances of the meshes)
                 axiom  share   max cm  median cm  stdev cm   seconds
no steps       199,170              13.66       0.36      0.59
1 step         136,423   68 %      16.42       1.11      0.96        30
2 steps         77,123   39 %      90.70      12.42     10.68
3 steps         42,627   21 %     140.89      12.35     24.17       120"""


def shared() -> Path:
    return Path(os.environ.get("TREEPIPE_DATA", ROOT / ".." / "shared" / "data")).resolve()


def ours() -> dict[str, dict[str, Any]]:
    """Return the documents of the twins, and of tree1 as we reconstruct it."""
    from pipeline.cloud import read_cloud
    from pipeline.lsystem import LsystemOptions, encode
    from pipeline.run import reconstruct
    from tests.lsystem.test_twins_of_2021 import read_twin

    twins = {
        name: encode(read_twin(shared() / "ls2021" / f"{name}_skeleton.ply"))
        for name in ("Lille_2", "Lille_11")
    }
    tree = reconstruct(read_cloud(shared() / "trees" / "tree1.xyz"))
    return {
        **twins,
        "tree1": encode(tree),
        "tree1, no radii": encode(tree, options=LsystemOptions(radii="none")),
    }


def of_2021() -> dict[str, dict[str, Any]]:
    """Return the documents that were written in 2021, and the recursive one expanded and written by us."""
    from pipeline.lsystem import decode, encode, read_lsjson

    found = {path.stem: read_lsjson(path) for path in sorted((shared() / "ls2021").glob("*.json"))}
    return {**found, "in_a, expanded": encode(decode(found["in_a"]))}


def best_of_three(function: Callable[..., Any], document: dict[str, Any], options: Any) -> tuple[Any, float]:
    seconds = []
    for _ in range(3):
        begin = time.perf_counter()
        result = function(document, options=options)
        seconds.append(time.perf_counter() - begin)
    return result, min(seconds)


def to_the_skeleton(before: dict[str, Any], after: dict[str, Any]) -> tuple[float, float]:
    """Return the median and the largest distance of moved nodes from the skeleton before, in metres."""
    from pipeline.lsystem import decode
    from pipeline.lsystem.transforms.subtrees import told_in

    skeleton = decode(before).skeleton
    foot = skeleton.xyz[np.maximum(skeleton.parent, 0)]
    along = np.linspace(0, 1, 41)[:, None, None]
    points = (foot + along * (skeleton.xyz - foot)).reshape(-1, 3)
    one, two = told_in(before).path.xyz, told_in(after).path.xyz
    moved = (one != two).any(axis=1)
    if not moved.any():
        return 0.0, 0.0
    near = cKDTree(points).query(two[moved])[0]
    return float(np.median(near)), float(near.max())


def of_generalising() -> None:
    from pipeline.lsystem.transforms.generalise import GeneraliseOptions, deviation, generalise

    print(REPORT)
    theirs = of_2021()
    figures = deviation(theirs["Lille_2_lsystem"], theirs["Lille_2_lsystem_gen"])["generalised_deviation_m"]
    print("\n2021, their own Lille_2 at 1 step, averaged nodes (cm):", end=" ")
    print(", ".join(f"{key} {100 * value:.2f}" for key, value in figures.items()))
    print(
        "\nsteps  K made    axiom share  rules |    max   mean median  stdev |   mean median  stdev |"
        "  near   max |    s"
    )
    print(
        " " * len("steps  K made    axiom share  rules |")
        + "          all nodes, cm      |  averaged ones, cm   |"
    )
    for name, before in ours().items():
        print(f"{name}: {before['axiom'].count('F') + 1:,} nodes, axiom {len(before['axiom']):,}")
        for steps in (1, 2, 3):
            for rules in (1, 4, 16, 64):
                options = GeneraliseOptions(steps=steps, rules=rules)
                after, seconds = best_of_three(generalise, before, options)
                figures = deviation(before, after)
                every, some = figures["deviation_m"], figures["generalised_deviation_m"]
                axiom = len(after["axiom"].encode())
                told = sum(len(s.encode()) + len(t) + 8 for s, t in after["rules"].items())
                near, far = to_the_skeleton(before, after)
                print(
                    f"{steps:5d} {rules:2d} {len(after['rules']):4d} {axiom:8,d}",
                    f"{axiom / len(before['axiom']):5.1%} {told:6,d} |",
                    *(f"{100 * every[key]:6.2f}" for key in ("max", "mean", "median", "stdev")),
                    "|",
                    *(f"{100 * some[key]:6.2f}" for key in ("mean", "median", "stdev")),
                    f"| {100 * near:5.2f} {100 * far:5.1f} | {seconds:4.2f}",
                    flush=True,
                )


def of_repeats() -> None:
    from pipeline.lsystem.transforms.factoring import written_bytes
    from pipeline.lsystem.transforms.generalise import deviation
    from pipeline.lsystem.transforms.repeats import RepeatsOptions, repeats

    print(
        f"\n{'repeats':22} {'tolerance':>9} {'bytes':>8} {'after':>8} {'share':>6} {'rules':>5} deep"
        f" {'max mm':>7} {'mean mm':>7}    s"
    )
    for name, before in {**ours(), **of_2021()}.items():
        for tolerance in (0, 0.001, 0.005, 0.02):
            options = RepeatsOptions(tolerance_m=tolerance)
            after, seconds = best_of_three(repeats, before, options)
            size, less = (written_bytes(d["axiom"], d["rules"]) for d in (before, after))
            apart = deviation(before, after)["deviation_m"]
            print(
                f"{name:22} {1000 * tolerance:6.0f} mm {size:8,d} {less:8,d} {less / size:6.1%}",
                f"{len(after['rules']):5d} {after['recursions']:4d}",
                f"{1000 * apart['max']:7.3f} {1000 * apart['mean']:7.3f} {seconds:4.2f}",
                flush=True,
            )


if __name__ == "__main__":
    of_generalising()
    of_repeats()
