"""Segmentation against field truth: precision, recall, F1 and errors, one-to-one matched.

Run as ``python tests/benchmarks/airborne_quality.py [FOLDER]`` with the folder that holds tiles/.
"""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

import numpy as np
from scipy.optimize import linear_sum_assignment

from pipeline.airborne.allometry import AllometryOptions, breast_height_diameter
from pipeline.airborne.segmentation import SegmentationOptions, Segmented, segment
from pipeline.cloud import read_cloud
from pipeline.model import PointCloud

CONIFERS = frozenset({"PIAB", "ABAL", "PISY", "LADE", "PINI", "TABA"})
BIOME = "temperate-conifer"
AHN4_BOX = (124800.0, 486350.0, 124834.56, 486400.0)
TOO_FAR = 1e6


def match(found, truth, tolerance_m, near=None):
    """Return positions in both of the pairs that cost least, none farther apart than the tolerance."""
    away = np.linalg.norm(found[:, None] - truth[None], axis=2)
    cost = np.where(away <= tolerance_m, away, TOO_FAR)
    if near is not None:
        cost = np.where(near, cost, TOO_FAR)
    a, b = linear_sum_assignment(cost)
    good = cost[a, b] < TOO_FAR
    return a[good], b[good]


def scores(matched: int, found: int, truth: int) -> tuple[float, float, float]:
    """Return precision, recall and F1."""
    return matched / max(found, 1), matched / max(truth, 1), 2 * matched / max(found + truth, 1)


def facts(cloud: PointCloud, made: Segmented):
    """Return world places of bases and apexes, heights and crown diameters."""
    base = np.array([t.base for t in made.trees]).reshape(-1, 2) + cloud.origin[:2]
    apex = np.array([t.apex[:2] for t in made.trees]).reshape(-1, 2) + cloud.origin[:2]
    height = np.array([t.apex[2] - t.ground_z for t in made.trees])
    return base, apex, height, np.array([t.crown_diameter_m for t in made.trees])


def ahn4(folder: Path, options: SegmentationOptions) -> dict[str, float]:
    """Score the street trees of the AHN4 tile, with bases and with apexes."""
    import pyogrio.raw

    shapes = pyogrio.raw.read(folder / "tiles" / "ahn4_2496_9727.truth.gpkg")[2]
    truth = np.array([np.frombuffer(wkb[-16:], "<f8") for wkb in shapes])
    cloud = read_cloud(folder / "tiles" / "ahn4_2496_9727.laz")
    base, apex, *_ = facts(cloud, segment(cloud, options=options))
    x0, y0, x1, y1 = AHN4_BOX
    out = {}
    for name, place in (("base", base), ("apex", apex)):
        inside = (place >= (x0, y0)).all(axis=1) & (place <= (x1, y1)).all(axis=1)
        for tolerance in (1.0, 3.0):
            pairs = match(place[inside], truth, tolerance)
            out[f"ahn4_{name}_f1_{tolerance:.0f}m"] = scores(len(pairs[0]), inside.sum(), len(truth))[2]
    return out


def chablais(folder: Path, options: SegmentationOptions) -> dict[str, float]:
    """Score the Alpine plot: places within 3 m and heights within 20 %, in the plot's own extent."""
    path = folder / "tiles" / "chablais3.inventory.csv"
    table = np.genfromtxt(path, delimiter=",", names=True, dtype=None, encoding="utf-8")
    table = table[table["d"] >= 7.5]
    truth = np.column_stack([table["x"], table["y"]])
    cloud = read_cloud(folder / "tiles" / "chablais3.laz")
    base, _, height, wide = facts(cloud, segment(cloud, options=options))
    inside = ((base >= truth.min(axis=0) - 1) & (base <= truth.max(axis=0) + 1)).all(axis=1)
    near = np.abs(height[inside][:, None] - table["h"]) <= 0.2 * table["h"]
    a, b = match(base[inside], truth, 3.0, near)
    precision, recall, f1 = scores(len(a), int(inside.sum()), len(truth))
    off = height[inside][a] - table["h"][b]
    return {
        "chablais_found": float(inside.sum()), "chablais_precision": precision, "chablais_recall": recall,
        "chablais_f1": f1, "chablais_height_rmse_m": float(np.sqrt((off**2).mean())),
        "chablais_height_bias_m": float(off.mean()),
        **diameters(height[inside][a], wide[inside][a], table[b]),
    }  # fmt: skip


def diameters(height, crown, truth) -> dict[str, float]:
    """Score stem diameters by the rows of kinds of leaf, and by the global one; shares of the mean."""
    kinds = ["gymnosperm" if name in CONIFERS else "angiosperm" for name in truth["s"]]
    rows = {
        "leaf": [AllometryOptions(biome=BIOME, leaf_type=kind) for kind in kinds],
        "mixed": [AllometryOptions(biome="palearctic-temperate-mixed", leaf_type=kind) for kind in kinds],
        "global": [AllometryOptions()] * len(kinds),
    }
    out = {}
    for name, options in rows.items():
        told = [
            breast_height_diameter(h, c, options=o) for h, c, o in zip(height, crown, options, strict=True)
        ]
        lo, hi = (np.array([100 * getattr(one, end) for one in told]) for end in ("lo_m", "hi_m"))
        off = np.array([100 * one.dbh_m for one in told]) - truth["d"]
        out[f"dbh_rmse_{name}"] = float(np.sqrt((off**2).mean()) / truth["d"].mean())
        out[f"dbh_bias_{name}_cm"] = float(off.mean())
        out[f"dbh_within_{name}"] = float(((truth["d"] >= lo) & (truth["d"] <= hi)).mean())
    return out


def single(folder: Path, options: SegmentationOptions) -> dict[str, float]:
    """Height of the single tree with its ground beside it."""
    trees = folder / "trees"
    cloud, soil = (read_cloud(trees / f"ahn4_121913_487434{end}") for end in (".las", ".ground.laz"))
    made = segment(cloud, ground=soil, options=options)
    return {"single_trees": len(made.trees), "single_height_m": max(facts(cloud, made)[2])}


def main() -> None:
    """Print what is measured."""
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else os.environ.get("TREEPIPE_DATA", "../shared/data"))
    options = SegmentationOptions()
    for part in (ahn4, chablais, single):
        begin = time.process_time()
        print({k: round(float(v), 3) for k, v in part(folder, options).items()}, end=" ")
        print(f"{time.process_time() - begin:.1f} s")


if __name__ == "__main__":
    main()
