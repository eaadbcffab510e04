"""The tables of the 2021 report (Delft synthesis project, chapter 4) with our figures beside theirs.

    python tests/benchmarks/report_tables.py

Needs the clouds of TREEPIPE_DATA (by default ../shared/data). Distances in centimetres, as in the report.
Theirs compare with AdTree's skeleton and mesh; ours with our own reconstruction of the same clouds: what
is measured is what writing and reading cost, not how well a tree was found (docs/accuracy.md has that).
"""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path

import pipeline
from pipeline.accuracy import compare
from pipeline.cityjson import from_cityjson, to_cityjson
from pipeline.config import Config
from pipeline.exchange import write
from pipeline.lsystem import GeneraliseOptions, ScaleOptions, decode, encode, generalise, grow

DATA = Path(os.environ.get("TREEPIPE_DATA", Path(__file__).parents[2] / "../shared/data"))
TREES = {
    "Mobile_tree_1": "mobile_tree_1.xyz",
    "tree1": "tree1.xyz",
    "tree7": "tree7.xyz",
    "Lille_2": "Lille_2.xyz",
    "Lille_11": "Lille_11.xyz",
    "LAS_009": "ahn_LAS00_9.xyz",
}
# max, median, stdev in cm
SKELETONS = {
    "Mobile_tree_1": (0.39, 0.11, 0.07),
    "tree1": (46.00, 0.11, 2.43),
    "tree7": (299.93, 1.11, 53.74),
    "Lille_2": (5.04, 0.13, 0.07),
    "Lille_11": (0.05, 0.04, 0.07),
    "LAS_009": (631.99, 343.89, 99.59),
}
MESHES = {
    "Mobile_tree_1": (16.1, 0.37, 0.33),
    "tree1": (13.66, 0.36, 0.59),
    "tree7": (272.40, 0.18, 13.00),
    "Lille_2": (28.38, 2.27, 1.37),
    "Lille_11": (8.86, 0.20, 0.24),
    "LAS_009": (44.07, 5.00, 5.05),
}
CITYJSON = {
    "Mobile_tree_1": (14.96, 1.00, 1.13),
    "tree1": (9.49, 1.82, 1.00),
    "tree7": (15.86, 0.84, 0.52),
    "Lille_2": (29.40, 3.17, 2.11),
    "Lille_11": (7.72, 0.91, 0.70),
    "LAS_009": (6.37, 0.65, 0.08),
}
GENERALISED = {0: (13.66, 0.36, 0.59, 199170), 1: (16.42, 1.11, 0.96, 136423)}
GENERALISED |= {2: (90.70, 12.42, 10.68, 77123), 3: (140.89, 12.35, 24.17, 42627)}
SPROUTS = (958, 611, 367, 234, 157)
# kB: LsJSON, generalised, CityJSON, skeleton PLY, mesh OBJ
SIZES = {
    "Mobile_tree_1": (392, 260, 3848, 530, 30528),
    "tree1": (200, 137, 1922, 225, 11674),
    "tree7": (195, 132, 1871, 221, 11264),
    "Lille_2": (537, 376, 5295, 734, 46680),
    "Lille_11": (353, 257, 3448, 475, 22132),
}


def table(title: str, head: str, rows: list[str]) -> None:
    print(f"\n### {title}\n\n{head}\n|{'---|' * (head.count('|') - 1)}")
    print("\n".join(rows), flush=True)


def cm(spread) -> str:
    return " | ".join(f"{value / 10:.3f}" for value in (spread.max_mm, spread.median_mm, spread.stdev_mm))


def deviations(trees, again, theirs, part: str) -> list[str]:
    rows = []
    for name, tree in trees.items():
        found = getattr(compare(again(tree), tree), part)
        told = " | ".join(f"{value:.2f}" for value in theirs[name])
        rows.append(f"| {name} | {told} | {cm(found)} |")
    return rows


def kilobytes(tree, document, folder: Path) -> list[float]:
    sizes = []
    for name in ("t.ls.json", "g.ls.json", "t.city.json", "t.skeleton.ply", "t.obj", "t.ls.json.zst"):
        path = folder / name
        if name == "g.ls.json":
            pipeline.lsystem.write_lsjson(generalise(document, options=GeneraliseOptions(steps=1)), path)
        else:
            write(tree, path)
        sizes.append(path.stat().st_size / 1000)
    return sizes


def main() -> None:
    if not (DATA / "trees").is_dir():
        sys.exit(f"{DATA}: no clouds there; set TREEPIPE_DATA")
    trees = {
        name: pipeline.reconstruct(pipeline.read_cloud(DATA / "trees" / file)) for name, file in TREES.items()
    }
    head = "| tree | 2021: max, cm | median | stdev | ours: max, cm | median | stdev |"
    table(
        "4.1 L-system against skeleton, node by node",
        head,
        deviations(trees, lambda tree: decode(encode(tree)), SKELETONS, "nodes"),
    )
    table(
        "4.2 L-system mesh against mesh",
        head,
        deviations(trees, lambda tree: decode(encode(tree)), MESHES, "surface"),
    )
    table(
        "4.3 CityJSON mesh against mesh",
        head,
        deviations(trees, lambda tree: from_cityjson(to_cityjson(tree, name="t")), CITYJSON, "surface"),
    )

    tree = trees["tree1"]
    document, rows = encode(tree), []
    for steps, told in GENERALISED.items():
        short = generalise(document, options=GeneraliseOptions(steps=steps)) if steps else document
        found = compare(decode(short), tree).surface
        share = len(short["axiom"]) / len(document["axiom"])
        rows.append(
            f"| {steps} | {told[0]} | {told[1]} | {told[2]} | {told[3]:,} ({told[3] / 199170:.0%}) "
            f"| {cm(found)} | {len(short['axiom']):,} ({share:.0%}) |"
        )
    head = "| steps | 2021: max, cm | median | stdev | axiom | ours: max, cm | median | stdev | axiom |"
    table("4.4 generalised tree1, meshes", head, rows)

    own = [len(decode(grow(document, years=1, options=ScaleOptions(sprout_position=p)))) for p in range(1, 6)]
    rows = [f"| {p} | {SPROUTS[p - 1]} | {own[p - 1] - len(tree)} |" for p in range(1, 6)]
    table("4.5 new nodes by sprout position, tree1", "| position | 2021 | ours |", rows)

    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for name, told in SIZES.items():
            sizes = kilobytes(trees[name], encode(trees[name]), Path(folder))
            pairs = " | ".join(f"{old:,} / {new:,.0f}" for old, new in zip(told, sizes, strict=False))
            rows.append(f"| {name} | {len(trees[name]):,} | {pairs} | {sizes[-1]:,.0f} |")
    head = (
        "| tree | nodes (ours) | LsJSON | generalised | CityJSON | skeleton PLY | mesh OBJ | .ls.json.zst |"
    )
    table("4.6 kilobytes, 2021 / ours", head, rows)

    rows = []
    cloud = pipeline.read_cloud(DATA / "trees" / TREES["Lille_2"])
    for voxel in (0.0, 0.10, 0.20, 0.25):
        settings = [f"clean.voxel_m={voxel}"] if voxel else []
        thin = pipeline.reconstruct(cloud, Config().with_settings(settings))
        told = pipeline.report(thin)
        found = compare(thin, trees["Lille_2"])
        dbh = "unknown" if told.dbh_cm is None else f"{told.dbh_cm:.1f}"
        rows.append(
            f"| {voxel or 'as it is'} | {told.points_used:,} | {told.method} | {told.height_m:.1f} | {dbh} "
            f"| {told.length_m:,.0f} | {found.recall:.2f} / {found.precision:.2f} |"
        )
    head = "| cell, m | points | method | height, m | DBH, cm | length, m | recall / precision |"
    table("Section 4.2, density: Lille_2 thinned, against the model of all points", head, rows)

    rows = []
    for kind, name in (("airborne", "LAS_009"), ("mobile", "Mobile_tree_1"), ("static", "Lille_2")):
        told = pipeline.report(trees[name])
        dbh = f"{told.dbh_cm:.1f} ({told.dbh_lo_cm:.1f}-{told.dbh_hi_cm:.1f}), {told.dbh_source}"
        rows.append(
            f"| {kind} | {name} | {told.points_in:,} | {told.method} | {told.height_m:.1f} | {dbh} "
            f"| {told.surface_mm['mean']:.1f} | {', '.join(told.flags) or 'none'} |"
        )
    head = "| source | tree | points | method | height, m | DBH, cm | points from bark, mm | flags |"
    table("Section 4.3, sources", head, rows)


if __name__ == "__main__":
    main()
