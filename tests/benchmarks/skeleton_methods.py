"""Which skeleton method finds what: every method on scans of known trees of every kind.

    python tests/benchmarks/skeleton_methods.py OUT [--kinds tubes ...] [--scans "tls" ...] [--seeds 1 2]

OUT/cases keeps a JSON file per scan of a tree, with the figures of every method: what is there is not worked
out again, so that the table can be stopped, and continued when a kind or a method joins. Printed are medians
over habits and seeds, per kind and scan and over all kinds:

    found      median distance from the true axes to the model, cm
    true       median distance from the model's axes to the true ones, cm
    recall     share of the true axes within 5 cm of the model; precision the other way round
    length     length of the model by that of the truth
    order      share of the recalled axes with the right branch order
    CPU s      of the skeleton from the cleaned cloud on, one process, compiled code warm
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

METHODS = ("geodesic", "greedy", "mst", "space-colonization", "minimal-length")
HABITS = ("decurrent", "excurrent")
SCANS: dict[str, tuple[str, dict[str, Any]]] = {
    "tls": ("tls", {"step_deg": 0.1}),
    "tls, leaves": ("tls", {"step_deg": 0.1, "leaves": True}),
    "tls, thin": ("tls", {"step_deg": 0.25}),
    "tls, coarse": ("tls", {"step_deg": 0.37}),
    "als 40": ("als", {"density_per_m2": 40.0}),
    "als 20": ("als", {"density_per_m2": 20.0}),
    "als 10": ("als", {"density_per_m2": 10.0}),
    "als 20, leaves": ("als", {"density_per_m2": 20.0, "leaves": True}),
}
SMALLER: dict[str, dict[str, Any]] = {"colonization": {"iterations": 22}}
"""Options that keep the trees of a kind small."""
TABLES = {
    "found, true (cm)": {"found": 1, "true": 1},
    "recall, precision": {"recall": 2, "precision": 2},
    "length, order": {"length": 2, "order": 2},
    "CPU s": {"CPU s": 2},
}
"""Tables that are printed: figures and their digits."""


def trees(kinds: Sequence[str], seeds: Sequence[int]) -> Iterator[tuple[dict[str, Any], Any]]:
    """Every tree with what it is; one without presets for the kinds that know none of the habits."""
    from pipeline.synthetic import KINDS

    for name in kinds or KINDS:
        kind = KINDS[name]
        for habit in [preset for preset in HABITS if preset in kind.presets] or [""]:
            for seed in seeds:
                chosen = {**(kind.preset(habit) if habit else {}), **SMALLER.get(name, {}), "seed": seed}
                yield (
                    {"kind": name, "habit": habit, "seed": seed},
                    lambda k=kind, c=chosen: k.grow(k.options(**c)),
                )


def scanned(tree: Any, name: str, seed: int) -> Any:
    """The cleaned cloud of a scan."""
    from pipeline.cloud import clean
    from pipeline.synthetic import SCANNERS, scan

    scanner, chosen = SCANS[name]
    return clean(scan(tree, options=SCANNERS[scanner](**{**chosen, "seed": seed})).cloud)


def measured(cloud: Any, tree: Any, method: str) -> dict[str, Any]:
    """The figures of a method, or why there are none."""
    from pipeline.accuracy import compare
    from pipeline.errors import PipelineError
    from pipeline.skeleton import SkeletonOptions, extract

    options = SkeletonOptions(method=method)
    try:
        begin = time.process_time()
        skeleton = extract(cloud, options=options)
        seconds = time.process_time() - begin
    except PipelineError as error:
        return {"error": str(error)}
    there, back = compare(skeleton, tree.skeleton), compare(tree.skeleton, skeleton)
    return {
        "error": None,
        "found": back.axis.median_mm / 10,
        "found mean": back.axis.mean_mm / 10,
        "true": there.axis.median_mm / 10,
        "true mean": there.axis.mean_mm / 10,
        "recall": there.recall,
        "precision": there.precision,
        "length": float(skeleton.length.sum() / tree.skeleton.length.sum()),
        "order": there.order_accuracy,
        "CPU s": seconds,
    }


def case(out: Path, known: dict[str, Any], grow: Any, name: str) -> dict[str, Any]:
    """All methods on one scan; from the file where they are there."""
    from pipeline.errors import NotATreeError

    path = out / "cases" / f"{known['kind']}_{known['habit']}_{known['seed']}_{name.replace(', ', '-')}.json"
    told: dict[str, Any] = (
        json.loads(path.read_text()) if path.is_file() else {**known, "scan": name, "methods": {}}
    )
    wanted = [method for method in METHODS if method not in told["methods"]]
    if not wanted:
        return told
    tree = grow()
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        cloud = scanned(tree, name, known["seed"])
    except NotATreeError as error:  # a small tree from far above
        told |= {"points": 0, "spacing_mm": None, "methods": {key: {"error": str(error)} for key in METHODS}}
        path.write_text(json.dumps(told, indent=1) + "\n")
        return told
    dropped = cloud.metadata["dropped"].get("leaf", 0)
    told |= {
        "points": len(cloud),
        "spacing_mm": 1000 * float(cloud.metadata["spacing_m"]),
        "leaf_share": dropped / max(dropped + len(cloud), 1),
        "true_m": float(tree.skeleton.length.sum()),
    }
    for method in wanted:
        told["methods"][method] = measured(cloud, tree, method)
    path.write_text(json.dumps(told, indent=1) + "\n")
    return told


def warm() -> None:
    """Compile every method's loops before the clock runs."""
    from pipeline.skeleton import SkeletonOptions, extract
    from pipeline.synthetic import KINDS

    tree = KINDS["tubes"].grow(KINDS["tubes"].options(**KINDS["tubes"].preset("sapling")))
    for name in ("tls", "als 40"):
        cloud = scanned(tree, name, 1)
        for method in METHODS:
            extract(cloud, options=SkeletonOptions(method=method))


def table(results: Sequence[dict[str, Any]]) -> str:
    """Medians as Markdown tables, a row per kind and scan, a column per method."""
    return "\n".join(_one_table(results, title, keys) for title, keys in TABLES.items())


def _one_table(results: Sequence[dict[str, Any]], title: str, keys: dict[str, int]) -> str:
    lines = [
        title,
        "",
        f"| | scan | spacing cm | {' | '.join(METHODS)} |",
        f"|---|---|---|{'---|' * len(METHODS)}",
    ]
    for kind in (*dict.fromkeys(result["kind"] for result in results), "all"):
        for name in SCANS:
            asked = [r for r in results if r["scan"] == name and kind in (r["kind"], "all")]
            group = [r for r in asked if r["points"]]  # of the others nothing is known
            if group:
                spacing = np.median([r["spacing_mm"] for r in group]) / 10
                cells = (_cell(group, method, keys) for method in METHODS)
                lines.append(f"| {kind} | {name} | {spacing:.1f} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def _cell(group: Sequence[dict[str, Any]], method: str, keys: dict[str, int]) -> str:
    known = [r["methods"][method] for r in group if r["methods"][method]["error"] is None]
    found = {key: [k[key] for k in known if k[key] is not None] for key in keys}
    return ", ".join(f"{np.median(found[key]):.{d}f}" if found[key] else "-" for key, d in keys.items())


def main() -> None:
    """Work through the cases and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("out", type=Path)
    parser.add_argument("--kinds", nargs="*", default=())
    parser.add_argument("--scans", nargs="*", default=tuple(SCANS), choices=tuple(SCANS))
    parser.add_argument("--seeds", nargs="*", type=int, default=(1, 2))
    chosen = parser.parse_args()
    warm()
    results = []
    for known, grow in trees(chosen.kinds, chosen.seeds):
        for name in chosen.scans:
            results.append(case(chosen.out, known, grow, name))
            print(*known.values(), name, results[-1]["points"], file=sys.stderr, flush=True)
    text = table(results)
    (chosen.out / "table.md").write_text(text)
    print(text)


if __name__ == "__main__":
    main()
