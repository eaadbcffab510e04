"""Seconds per stage and peak memory against the number of points.

    python tests/benchmarks/stages.py [--sizes 12,30,100,350,1000]

A known-truth tree of the project's own generator is sampled at each size (thousands of points). Every
size runs in a process of its own: once to warm up (compiling, loading), once counted.
"""

from __future__ import annotations

import argparse
import multiprocessing
import resource
import tempfile
import time
from pathlib import Path

STAGES = ("clean", "skeleton", "fit", "write", "total")


def run(thousands: int) -> dict[str, float]:
    """Reconstruct and write one tree of so many thousand points, warm."""
    from pipeline.run import Outputs, reconstruct, write_outputs
    from pipeline.store import Store
    from pipeline.synthetic import SampleOptions, TubeTreeOptions, grow_tubes, sample

    tree = grow_tubes(TubeTreeOptions(seed=7))
    dense = sample(tree, options=SampleOptions(density_per_m2=2000.0, noise_m=0.003, seed=1))
    density = 2000.0 * 1000 * thousands / len(dense)
    cloud = sample(tree, options=SampleOptions(density_per_m2=density, noise_m=0.003, seed=1))
    reconstruct(sample(tree, options=SampleOptions(density_per_m2=300.0, noise_m=0.003, seed=1)))
    with tempfile.TemporaryDirectory() as folder:
        outputs = Outputs(Path(folder), "tree", picture=False)
        write_outputs(reconstruct(dense), dense, outputs)
        begin, store = time.perf_counter(), Store()
        model = reconstruct(cloud, None, store)
        write_outputs(model, cloud, outputs, store=store)
        seconds = {**store.seconds, "total": time.perf_counter() - begin}
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return {"points": len(cloud), "nodes": len(model), "peak_mb": peak, **seconds}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--sizes", default="12,30,100,350,1000", help="thousands of points")
    sizes = [int(text) for text in parser.parse_args().sizes.split(",")]
    print(f"{'points':>9} {'nodes':>7}", *(f"{s:>9}" for s in STAGES), f"{'peak MB':>8}")
    for size in sizes:
        with multiprocessing.get_context("spawn").Pool(1) as pool:
            row = pool.apply(run, (size,))
        figures = (f"{row[s]:9.2f}" for s in STAGES)
        print(f"{row['points']:9d} {row['nodes']:7d}", *figures, f"{row['peak_mb']:8.0f}", flush=True)


if __name__ == "__main__":
    main()
