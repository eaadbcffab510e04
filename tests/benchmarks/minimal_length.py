"""How near to the least length the ways of the minimal-length method come, and how long they take.

    python tests/benchmarks/minimal_length.py

Leaves are random in an ellipsoid of 6 m by 8 m around a trunk of 11.2 m. Seconds are the least of three,
warm, on one core; per cent are lengths above the least one, which is proven where it says so. Medians over
seeds. Then whole clouds, from the cleaned points to the skeleton, beside the space colonization method.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))
SEEDS = range(5)
DENSITIES = (20, 40, 70)
T = TypeVar("T")


def timed(work: Callable[[], T], repeats: int = 3) -> tuple[T, float]:
    """What the work gives, and the quickest of a few runs after one to warm up."""
    work()
    seconds = []
    for _ in range(repeats):
        start = time.perf_counter()
        found = work()
        seconds.append(time.perf_counter() - start)
    return found, min(seconds)


def small() -> None:
    """Print what is proven, and how far greedy and searches are from it."""
    from pipeline.skeleton.minimal.attaching import attach_all
    from pipeline.skeleton.minimal.exact import solve
    from pipeline.skeleton.minimal.histories import all_histories
    from pipeline.skeleton.minimal.reattaching import reattach
    from pipeline.skeleton.minimal.search import Budget, search
    from tests.skeleton.minimal.problems import crown

    print("leaves  histories  proven   s      | greedy %     s   | quick %      s   | 150 bunches %   s")
    for count in (24, 50, 80, 120):
        rows = []
        for seed in SEEDS:
            problem = crown(count, seed)
            greedy, greedy_s = timed(lambda p=problem: attach_all(p))
            quick, quick_s = timed(lambda g=greedy, c=count: reattach(g, rounds=2 * c, seed=0))
            deep, deep_s = timed(lambda g=greedy: search(g, Budget(2, 150)), 1)
            whole = all_histories(problem, most=100_000)
            best, seconds = timed(lambda p=problem, q=quick: solve(all_histories(p, most=100_000), q))
            above = [100 * (s.total / best.system.total - 1) for s in (greedy, quick, deep)]
            rows.append(
                (len(whole), best.proven, seconds, above[0], greedy_s, above[1], quick_s, above[2], deep_s)
            )
        h, proven, s, *rest = np.median(np.array(rows, dtype=float), axis=0)
        a, b, c, d, e, f = rest
        print(f"{count:6} {h:10.0f} {proven:7.0%} {s:6.3f}  |", end=" ")
        print(f"{a:6.2f} {b:8.4f} | {c:6.2f} {d:8.4f} | {e:8.3f} {f:9.2f}")


def large() -> None:
    """Print how long many leaves take, and their lengths beside the shortest one found."""
    from pipeline.skeleton.minimal.attaching import attach_all
    from pipeline.skeleton.minimal.search import Budget
    from pipeline.skeleton.minimal.solving import shortest
    from tests.skeleton.minimal.problems import crown

    print("\nleaves   greedy s   default s  bunches s | greedy m  default m  bunches m  bound m")
    for count in (300, 1000, 2000):
        problem = crown(count, 1)
        greedy, greedy_s = timed(lambda p=problem: attach_all(p))
        quick, quick_s = timed(lambda p=problem: shortest(p, Budget(2, 0), exact_leaves=0), 1)
        start = time.perf_counter()
        deep = shortest(problem, Budget(2, 150), exact_leaves=0)
        deep_s = time.perf_counter() - start
        lengths = (greedy.total, quick.strict.total, deep.strict.total, deep.bound_m)
        print(
            f"{count:6} {greedy_s:10.4f} {quick_s:11.3f} {deep_s:10.2f} |",
            *(f"{length:9.1f}" for length in lengths),
        )


def clouds() -> None:
    """Print how long clouds from the air take."""
    from pipeline.cloud import clean
    from pipeline.skeleton import SkeletonOptions, extract
    from pipeline.synthetic import KINDS, AlsOptions, scan

    kind = KINDS["tubes"]
    tree = kind.grow(kind.options(**{**kind.preset("decurrent"), "seed": 1}))
    print("\npulses/m2  points  leaves  minimal-length s  space-colonization s")
    for density in DENSITIES:
        cloud = clean(scan(tree, options=AlsOptions(density_per_m2=density, seed=1)).cloud)
        mine, s = timed(lambda c=cloud: extract(c, options=SkeletonOptions(method="minimal-length")), 9)
        _, other = timed(lambda c=cloud: extract(c, options=SkeletonOptions(method="space-colonization")), 9)
        leaves = mine.metadata["minimal_length"]["leaves"]
        print(f"{density:9} {len(cloud):7} {leaves:7} {s:17.3f} {other:21.3f}")


if __name__ == "__main__":
    small()
    large()
    clouds()
