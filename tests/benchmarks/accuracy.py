"""How exact the reconstruction is, and what it costs: known-truth trees by method, and real clouds.

    python tests/benchmarks/accuracy.py [CLOUD ...]

Without clouds: data/samples, and truth/ and trees/ of the shared clouds (TREEPIPE_DATA) where they are
there. The truth of `NAME_scan.laz` or `NAME.laz` is `NAME.truth.npz` beside it; a cloud without one is a real
cloud, of which only the model's own figures are known. Errors are in percent; recall, precision and order are
shares of length; `above` is the mean distance of points from the surface, less what the truth itself has, in
mm; `ratio` is that of branches with 1 cm of radius and 10 cm of length; CPU seconds are those of skeleton and
fit, warm, of one process.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))
SHARES = ("recall", "precision", "order")
ERRORS = ("length", "dbh", "volume", "branches")
METHODS = ("mst", "auto")
REAL = (".xyz", ".las", ".laz", ".txt", ".asc")


def truth_of(cloud: Path) -> Path | None:
    """Find the truth that belongs to a cloud."""
    for stem in (cloud.stem, cloud.stem.rsplit("_", 1)[0]):
        if (found := cloud.with_name(f"{stem}.truth.npz")).exists():
            return found
    return None


def default_clouds() -> list[Path]:
    """The samples, and the shared clouds where they are."""
    shared = Path(os.environ.get("TREEPIPE_DATA", ROOT / ".." / "shared" / "data")).resolve()
    real = [
        path
        for path in sorted((shared / "trees").glob("*"))
        if path.suffix in REAL and not any(word in path.name for word in (".treeqsm", ".ground", ".simple"))
    ]
    return [
        *sorted((ROOT / "data" / "samples").glob("*.laz")),
        *sorted((shared / "truth").glob("*.laz")),
        *real,
    ]


def models(path: Path, methods: tuple[str, ...] = METHODS) -> Iterator[tuple[Any, float]]:
    """Every method's model of a cloud, and its CPU seconds from the cleaned cloud on."""
    import pipeline
    from pipeline.cloud import clean
    from pipeline.config import Config
    from pipeline.cylinders import fit
    from pipeline.skeleton import extract

    ground = path.with_name(f"{path.stem}.ground.laz")
    cloud = clean(pipeline.read_cloud(path), pipeline.read_cloud(ground) if ground.exists() else None)
    for method in methods:
        options = Config().with_settings([f"skeleton.method={method}"]).skeleton
        begin = time.process_time()
        tree = fit(cloud, extract(cloud, options=options))
        yield tree, time.process_time() - begin


def of_known_trees(clouds: list[Path]) -> None:
    """Print the table of the trees whose truth is known."""
    from tests.scorer import score

    print(
        f"{'cloud':15} {'method':9}", *(f"{c:>9}" for c in (*SHARES, *ERRORS)), " above ratio  nodes  CPU s"
    )
    for path in clouds:
        truth = np.load(truth_of(path))
        for tree, seconds in models(path):
            result = score(tree, truth, points=world_points(path))
            print(
                f"{path.stem:15} {tree.metadata['method']:9}",
                *(f"{result[c]:9.3f}" for c in SHARES),
                *(f"{100 * result[c]:+8.1f}%" for c in ERRORS),
                f"{result['above']:6.2f} {result['ratio']:5.2f} {len(tree):6d} {seconds:6.1f}",
                flush=True,
            )


def world_points(path: Path) -> Any:
    """Points that a surface is measured by: all that are neither ground nor noise."""
    import pipeline

    cloud = pipeline.read_cloud(path)
    classes = cloud.attributes.get("classification", np.zeros(len(cloud)))
    return cloud.world[~np.isin(classes, (2, 7, 9, 18))]


def of_real_trees(clouds: list[Path]) -> None:
    """Print the table of the clouds whose truth nobody knows."""
    print(
        f"{'cloud':22} {'method':9} {'surface mm':>10} {'nodes':>6} {'DBH cm':>7} {'from - to':>13}", end=" "
    )
    print(f"{'source':>11} {'volume L':>9} {'from - to':>15} {'length m':>9} {'leaf':>5} {'CPU s':>6}")
    for path in clouds:
        for tree, seconds in models(path):
            length, trunk, known = float(tree.skeleton.length.sum()), tree.trunk, tree.metadata
            low, high = known["volume_interval_l"]
            dbh = (
                "      -             -"
                if trunk.dbh_m is None
                else (f"{100 * trunk.dbh_m:7.1f} {100 * trunk.lo_m:6.1f}-{100 * trunk.hi_m:6.1f}")
            )
            volume, surface = 1000 * tree.volume.sum(), known["surface_mm"]["mean"]
            print(
                f"{path.stem:22} {known['method']:9} {surface:10.1f} {len(tree):6d} {dbh}",
                f"{trunk.source or '-':>11} {volume:9.0f} {low:7.0f}-{high:7.0f} {length:9.1f}",
                f"{known['dropped']['leaf'] / known['points_in']:5.2f} {seconds:6.1f}",
                flush=True,
            )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("clouds", nargs="*", type=Path)
    clouds = parser.parse_args().clouds or default_clouds()
    for path in clouds[:1]:
        list(models(path, ("mst", "geodesic", "greedy")))  # compiles what is not compiled yet
    of_known_trees([path for path in clouds if truth_of(path)])
    of_real_trees([path for path in clouds if not truth_of(path)])


if __name__ == "__main__":
    main()
