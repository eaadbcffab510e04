"""Seconds of one processor that simulated scans take, the scene included, warm.

    python tests/benchmarks/scanner.py [--repeat 5]

Targets: 200,000 terrestrial returns in 15 s, one airborne tree in 50 ms. Needs the extra `scan`.
"""

from __future__ import annotations

import argparse
import statistics
import time

import numpy as np

from pipeline.synthetic import AlsOptions, TlsOptions, TubeTreeOptions, grow_tubes, scan

CASES = {
    "tls, bare, bark alone": (TlsOptions(step_deg=0.028, ground_radius_m=0), 15.0),
    "tls, bare, ground": (TlsOptions(step_deg=0.045), 15.0),
    "tls, leaves, ground": (TlsOptions(leaves=True), 15.0),
    "tls, leaves, 4 neighbours": (TlsOptions(leaves=True, neighbours=4), 15.0),
    "als, bare": (AlsOptions(), 0.05),
    "als, leaves": (AlsOptions(leaves=True), 0.05),
}
"""What is scanned how, and the seconds that it may take (terrestrial: for 200,000 returns)."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--repeat", type=int, default=5, help="runs that are counted, after one to warm up")
    repeat = parser.parse_args().repeat
    tree = grow_tubes(TubeTreeOptions(seed=3))
    print(f"{'case':27} {'returns':>8} {'on tree':>8} {'median s':>9} {'least s':>8} {'target s':>9}")
    for name, (options, target) in CASES.items():
        made, seconds = scan(tree, options=options), []
        for _ in range(repeat):
            begin = time.process_time()
            made = scan(tree, options=options)
            seconds.append(time.process_time() - begin)
        allowed = target if isinstance(options, AlsOptions) else target * len(made.cloud) / 200_000
        on_tree = int((np.asarray(made.returns.surface) <= 1).sum())
        print(
            f"{name:27} {len(made.cloud):8d} {on_tree:8d} {statistics.median(seconds):9.3f} "
            f"{min(seconds):8.3f} {allowed:9.3f}"
        )


if __name__ == "__main__":
    main()
