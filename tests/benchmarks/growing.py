"""How trees grow: shoots by sprout position beside the report of 2021, and the seconds of a year.

    python tests/benchmarks/growing.py [DOCUMENT ...]

Without documents: those of 2021 among the shared data (TREEPIPE_DATA). The first tables count the new
vertices of one year at the sprout positions 1 to 5; `told` is the file as it is, where a branch of 2021 goes
on with the child told first; `axes` the same tree written anew, with its axes outside brackets. The report's
table 4.5 is of tree1, of which the file generalised by one step has all nodes. `fork` is the median angle
between a shoot at position 1 or 2 and the segment beside it, in degrees; `s` the least of three years with
everything growing; `kB` the size before and after.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))
REPORT = {"tree1_lsystem_gen_1": (958, 611, 367, 234, 157)}
POSITIONS = range(1, 6)


def default_documents() -> list[Path]:
    """The documents of 2021, where they are."""
    shared = Path(os.environ.get("TREEPIPE_DATA", ROOT / ".." / "shared" / "data")).resolve()
    return sorted((shared / "ls2021").glob("*lsystem*.json"))


def new_vertices(document: dict[str, Any]) -> list[int]:
    """Count the nodes that a year adds at every sprout position."""
    from pipeline.lsystem import decode
    from pipeline.lsystem.transforms.growing import ScaleOptions, grow

    def nodes(position: int) -> int:
        return len(decode(grow(document, years=1, options=ScaleOptions(sprout_position=position))))

    count = len(decode(document))
    return [nodes(position) - count for position in POSITIONS]


def fork_angle(document: dict[str, Any], position: int) -> float:
    """Measure the median angle between a shoot and the segment that goes on beside it, in degrees."""
    from pipeline.lsystem import decode
    from pipeline.lsystem.transforms.sprouting import shoots

    skeleton = decode(document).skeleton
    foot, step = shoots(skeleton.xyz, skeleton.parent, skeleton.continuation, position)
    beside = skeleton.xyz[skeleton.continuation[foot]] - skeleton.xyz[foot]
    size = np.linalg.norm(step, axis=1) * np.linalg.norm(beside, axis=1)
    cosine = (step * beside).sum(axis=1)[size > 0] / size[size > 0]
    return float(np.degrees(np.median(np.arccos(np.clip(cosine, -1, 1)))))


def seconds_and_growth(document: dict[str, Any]) -> tuple[float, dict[str, Any]]:
    """Grow by a year with everything on: least seconds of three, and the grown document."""
    from pipeline.lsystem.transforms.growing import ScaleOptions, grow

    options = ScaleOptions(sprout_position=1, speed=0.1, ratio=1.5, thickness=0.1)
    seconds = []
    for _ in range(3):
        begin = time.perf_counter()
        grown = grow(document, years=1, options=options)
        seconds.append(time.perf_counter() - begin)
    return min(seconds), grown


def main() -> None:
    from pipeline.lsystem import decode, encode, read_lsjson

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("documents", nargs="*", type=Path)
    paths = parser.parse_args().documents or default_documents()
    heads = (f"{f'p = {p}':>6}" for p in POSITIONS)
    print(f"{'document':22} {'nodes':>6} {'':7}", *heads, f"{'fork':>8} {'s':>6} {'kB':>11}")
    for path in paths:
        document = read_lsjson(path)
        anew = encode(decode(document))
        if path.stem in REPORT:
            print(f"{path.stem:22} {'':6} {'report':7}", *(f"{n:6d}" for n in REPORT[path.stem]))
        for name, source in (("told", document), ("axes", anew)):
            counts = (f"{n:6d}" for n in new_vertices(source))
            angles = "/".join(f"{fork_angle(source, p):.0f}" for p in (1, 2))
            seconds, grown = seconds_and_growth(source)
            sizes = f"{len(anew['axiom']) / 1000:.0f} > {len(grown['axiom']) / 1000:.0f}"
            print(f"{path.stem:22} {len(decode(source)):6d} {name:7}", *counts, end=" ")
            print(f"{angles:>8} {seconds:6.2f} {sizes:>11}", flush=True)


if __name__ == "__main__":
    main()
