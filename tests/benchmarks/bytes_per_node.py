"""What a stored tree costs: bytes a node of single files and archives, beside the tables of others.

    python tests/benchmarks/bytes_per_node.py [CLOUD ...]

Single files are `.ls.json` and `.ls.json.zst`; `line` is an archive of that one tree, packed, its index
included. Archives are of 200 grown trees and of all that is reconstructed here; `plain` is the same lines
unpacked, in one frame. Without clouds: those of the report of 2021, and some of trees/ and truth/, in the
shared clouds (TREEPIPE_DATA). Largest errors are of nodes, in mm.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))
SHARED = Path(os.environ.get("TREEPIPE_DATA", ROOT / ".." / "shared" / "data")).resolve()
TWINS = ("Lille_2", "Lille_11", "LAS00_9")
CLOUDS = (
    "trees/mobile_tree_1.xyz",
    "trees/tree1.xyz",
    "trees/tree7.xyz",
    "trees/Lille_2.xyz",
    "trees/Lille_11.xyz",
    "trees/ahn_LAS00_9.xyz",
    "trees/archi_tree1.las",
    "truth/syn_A_clean.laz",
    "truth/syn_B_clean.laz",
)
RADII = ("none", "exceptions", "all")
REPORT = {
    "mobile_tree_1": (392, 260, 3848, 530, 30528),
    "tree1": (200, 137, 1922, 225, 11674),
    "tree7": (195, 132, 1871, 221, 11264),
    "Lille_2": (537, 376, 5295, 734, 46680),
    "Lille_11": (353, 257, 3448, 475, 22132),
}
"""Table 4.6 of the report of 2021, kB: LsJSON, generalised, CityJSON, PLY, OBJ."""
DESIGN = """A tree of 5,000 nodes, bytes a node (raw, zstd -19), as designed:
  2021 style, 3 decimals, no radius       25.6    8.1
  closed loop, adaptive angles, no radius 21.4    5.7
  the same + radius 1 mm on every node    29.4    6.5
  integer graph                           15.3    4.8
  PLY ascii + edges                       35.5    7.9
  OBJ 12-gon tubes                       639    110
  entropy estimate                                2.6"""


def trees(clouds: list[Path]) -> Iterator[tuple[str, Any]]:
    """Reconstruct the clouds that are there."""
    from pipeline.cloud import read_cloud
    from pipeline.run import reconstruct

    for path in clouds:
        if path.exists():
            yield path.stem, reconstruct(read_cloud(path))


def single(name: str, tree: Any, modes: tuple[str, ...], folder: Path) -> None:
    """Print the row of one tree for every way of writing radii."""
    from pipeline.lsystem import LsystemOptions, encode, max_error, write_lsjson
    from pipeline.lsystem.storage.archive import ArchiveWriter
    from pipeline.lsystem.storage.compressed import write_compressed

    plain, small, line = (
        folder / f"a{suffix}" for suffix in (".ls.json", ".ls.json.zst", ".lsjson.jsonl.zst")
    )
    for mode in modes:
        document = encode(tree, options=LsystemOptions(radii=mode))
        write_lsjson(document, plain)
        write_compressed(small, plain.read_text(encoding="utf-8"))
        with ArchiveWriter(line) as archive:
            archive.add(name, {**document, "id": name})
        sizes = [path.stat().st_size / len(tree) for path in (plain, small, line)]
        error = 1000 * max_error(tree, document)
        print(
            f"{name:16} {mode:11} {len(tree):6d} {error:6.2f}",
            *(f"{size:8.2f}" for size in sizes),
            flush=True,
        )


def archived(name: str, models: list[tuple[str, Any]], mode: str, folder: Path) -> None:
    """Print the row of an archive."""
    from pipeline.lsystem import LsystemOptions, encode
    from pipeline.lsystem.storage.archive import Archive, ArchiveWriter
    from pipeline.lsystem.storage.compressed import compress

    documents = [{**encode(tree, options=LsystemOptions(radii=mode)), "id": id} for id, tree in models]
    path, nodes = folder / "b.lsjson.jsonl.zst", sum(len(tree) for _, tree in models)
    begin = time.process_time()
    with ArchiveWriter(path) as archive:
        for document in documents:
            archive.add(document["id"], document)
    seconds = time.process_time() - begin
    begin = time.process_time()
    Archive(path).read(models[-1][0])
    access = time.process_time() - begin
    lines = "\n".join(json.dumps(d, ensure_ascii=False, separators=(",", ":")) for d in documents)
    plain = len(compress(lines.encode(), path)) / nodes
    print(
        f"{name:16} {mode:11} {len(models):6d} {nodes:7d} {plain:8.2f} {path.stat().st_size / nodes:8.2f}",
        f"{1000 * seconds / len(models):10.1f} {1000 * access:9.1f}",
        flush=True,
    )


def beside_the_report(models: list[tuple[str, Any]], folder: Path) -> None:
    """Print the sizes of the report's five trees in kB beside ours."""
    from pipeline.lsystem import encode, write_lsjson
    from pipeline.lsystem.storage.archive import ArchiveWriter
    from pipeline.lsystem.storage.compressed import write_compressed

    print(
        "\nkB             2021: LsJSON generalised CityJSON   PLY    OBJ | ours: .ls.json .ls.json.zst  line"
    )
    for name, tree in models:
        if name in REPORT:
            paths = [folder / f"c{suffix}" for suffix in (".ls.json", ".ls.json.zst", ".lsjson.jsonl.zst")]
            write_lsjson(encode(tree), paths[0])
            write_compressed(paths[1], paths[0].read_text(encoding="utf-8"))
            with ArchiveWriter(paths[2]) as archive:
                archive.add(name, {**encode(tree), "id": name})
            theirs = REPORT[name]
            print(
                f"{name:19} {theirs[0]:7} {theirs[1]:11} {theirs[2]:8} {theirs[3]:5} {theirs[4]:6} |",
                "{:14.0f} {:12.0f} {:5.0f}".format(*(path.stat().st_size / 1000 for path in paths)),
            )


def main() -> None:
    from pipeline.synthetic import TubeTreeOptions, grow_tubes
    from tests.lsystem.test_twins_of_2021 import read_twin

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("clouds", nargs="*", type=Path)
    clouds = parser.parse_args().clouds or [SHARED / cloud for cloud in CLOUDS]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        print(f"{'bytes a node':16} {'radii':11}  nodes  error .ls.json ls.json.zst line")
        for twin in TWINS:
            if (path := SHARED / "ls2021" / f"{twin}_skeleton.ply").exists():
                single(f"{twin} 2021", read_twin(path), ("none",), folder)
        models = []
        for stem, tree in trees(clouds):
            single(stem, tree, RADII, folder)
            models.append((stem, tree))
        print(f"\n{'archives':16} {'radii':11}  trees   nodes    plain   packed ms to add ms to get")
        grown = [(f"tree-{seed}", grow_tubes(TubeTreeOptions(seed=seed))) for seed in range(200)]
        for mode in RADII:
            archived("200 grown", grown, mode, folder)
            if models:
                archived("reconstructed", models, mode, folder)
        beside_the_report(models, folder)
    print(f"\n{DESIGN}")


if __name__ == "__main__":
    main()
