"""How exact the reconstruction is on known-truth trees, by method.

    python tests/benchmarks/accuracy.py [CLOUD.laz ...]

Without clouds: data/samples, and truth/ of the shared clouds (TREEPIPE_DATA) where it is there. The truth
of `NAME_scan.laz` or `NAME.laz` is `NAME.truth.npz` beside it. Figures in percent are errors; recall,
precision and order are shares of length; CPU seconds are warm, clean to fit, one process.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))
COLUMNS = ("recall", "precision", "order", "length", "dbh", "volume", "branches")


def truth_of(cloud: Path) -> Path:
    """Find the truth that belongs to a cloud."""
    for stem in (cloud.stem, cloud.stem.rsplit("_", 1)[0]):
        if (found := cloud.with_name(f"{stem}.truth.npz")).exists():
            return found
    msg = f"{cloud}: no truth file beside it"
    raise SystemExit(msg)


def default_clouds() -> list[Path]:
    """The samples, and the shared known-truth clouds where they are."""
    shared = Path(os.environ.get("TREEPIPE_DATA", ROOT / ".." / "shared" / "data")) / "truth"
    return [*sorted((ROOT / "data" / "samples").glob("*.laz")), *sorted(shared.resolve().glob("*.laz"))]


def main() -> None:
    import pipeline
    from pipeline.config import Config
    from tests.scorer import score

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("clouds", nargs="*", type=Path)
    clouds = parser.parse_args().clouds or default_clouds()
    print(f"{'cloud':18} {'method':9}", *(f"{c:>9}" for c in COLUMNS), f"{'nodes':>6} {'CPU s':>6}")
    warm = True
    for path in clouds:
        cloud, truth = pipeline.read_cloud(path), np.load(truth_of(path))
        for method in ("mst", "geodesic"):
            config = Config().with_settings([f"skeleton.method={method}"])
            if warm:
                pipeline.reconstruct(cloud, config)
            begin = time.process_time()
            tree = pipeline.reconstruct(cloud, config)
            seconds = time.process_time() - begin
            result = score(tree, truth)
            shares = (f"{result[c]:9.3f}" for c in COLUMNS[:3])
            errors = (f"{100 * result[c]:+8.1f}%" for c in COLUMNS[3:])
            print(
                f"{path.stem:18} {method:9}", *shares, *errors, f"{len(tree):6d} {seconds:6.1f}", flush=True
            )
        warm = False


if __name__ == "__main__":
    main()
