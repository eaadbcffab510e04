"""The accuracy suite: trees of every kind, every scan of them, reconstructed and scored, a table of it."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from pipeline.accuracy import compare_cloud
from pipeline.errors import PipelineError
from pipeline.jobs.crew import work_through
from pipeline.output import write_text
from pipeline.run import reconstruct
from pipeline.synthetic import KINDS, SCANNERS, scan, truth_of, write_scan

SCANS: dict[str, tuple[str, dict[str, Any]]] = {
    "tls": ("tls", {}),
    "one station": ("tls", {"stations": 1}),
    "noisy": ("tls", {"noise_m": 0.010, "step_deg": 0.12}),
    "leaves": ("tls", {"leaves": True}),
    "als": ("als", {"density_per_m2": 40.0}),
}
"""Scans by name: the scanner, and its options where they are not the defaults."""

HABITS = ("decurrent", "excurrent", "pendulous")
"""Presets of each kind that take part, where it has them."""
SEEDS = (1, 2, 3)

FIGURES = {
    "recall": "recall",
    "precision": "precision",
    "order_accuracy": "order",
    "length_error_pct": "length %",
    "dbh_error_pct": "DBH %",
    "volume_error_pct": "volume %",
    "branch_volume_error_pct": "branch volume %",
    "branches_ratio": "ratio",
    "above_floor_mm": "above floor mm",
}
"""What is scored, with its name in the table."""


@dataclass(frozen=True)
class Case:
    """One scan of one tree."""

    kind: str
    preset: str
    scan: str
    seed: int

    @property
    def name(self) -> str:
        """Name of its files."""
        return f"{self.kind}_{self.preset}_{self.seed}_{self.scan.replace(' ', '-')}"


def cases(*, small: bool = False) -> list[Case]:
    """List what the suite is made of; the small one takes a minute."""
    if small:
        return [Case("tubes", "sapling", name, 1) for name in ("tls", "als")]
    return [
        Case(kind, preset, name, seed)
        for kind, known in KINDS.items()
        for preset in HABITS
        if preset in known.presets
        for name in SCANS
        for seed in SEEDS
    ]


@dataclass(frozen=True)
class Trial:
    """Grows, scans, reconstructs and scores one case; keeps the result, and takes it from there again."""

    out: Path

    def __call__(self, case: Case) -> dict[str, Any]:
        """Return the figures of a case, or why there are none."""
        kept = self.out / "cases" / f"{case.name}.json"
        if kept.is_file():
            found: dict[str, Any] = json.loads(kept.read_text(encoding="utf-8"))
            return found
        start = perf_counter()
        known = {"kind": case.kind, "preset": case.preset, "scan": case.scan, "seed": case.seed}
        try:
            told = {**known, "error": None, **self._scored(case)}
        except PipelineError as error:
            told = {**known, "error": str(error)}
        told["seconds"] = round(perf_counter() - start, 2)
        write_text(kept, json.dumps(told, indent=1) + "\n")
        return told

    def lost(self, case: Case, code: int | None) -> dict[str, Any]:
        """Return the result of a case whose process died; it is tried again the next time."""
        known = {"kind": case.kind, "preset": case.preset, "scan": case.scan, "seed": case.seed}
        return {**known, "error": f"its process ended with code {code}", "seconds": 0.0}

    def _scored(self, case: Case) -> dict[str, Any]:
        kind, (scanner, chosen) = KINDS[case.kind], SCANS[case.scan]
        grown = kind.grow(kind.options(**{**kind.preset(case.preset), "seed": case.seed}))
        made = scan(grown, options=SCANNERS[scanner](**{**chosen, "seed": case.seed}))
        write_scan(made, self.out / "scans" / f"{case.name}.laz")
        tree = reconstruct(made.cloud)
        found = compare_cloud(tree, made.cloud, truth_of(grown))
        figures = {key: getattr(found, key, None) for key in FIGURES if key != "above_floor_mm"}
        above = None
        if found.surface is not None and found.surface_floor_mm is not None:
            above = found.surface.mean_mm - found.surface_floor_mm
        trunk = tree.trunk
        return {
            "points": len(made.cloud),
            "method": tree.metadata.get("method"),
            **figures,
            "above_floor_mm": above,
            "dbh_source": None if trunk is None else trunk.source,
        }


def work_suite(
    out: Path, wanted: Sequence[Case], *, workers: int = 1, tell: Callable[[str], None] = lambda _: None
) -> list[dict[str, Any]]:
    """Work through the cases that have no result yet, and write the table.

    Parameters
    ----------
    out : Path
        Gets ``scans/``, ``cases/``, ``suite.json``, ``suite.md`` and ``suite.svg``.
    wanted : sequence of Case
    workers : int
        Number of processes; the results are the same.
    tell : callable, optional
        Told the name of each case when it is done.

    Returns
    -------
    list of dict
        A result per case, in their order.

    Raises
    ------
    OutputError
        If something cannot be written.
    """
    trial, found = Trial(out), dict[int, dict[str, Any]]()
    for number, result in work_through(trial, wanted, workers=workers, lost=trial.lost):
        found[number] = result
        tell(wanted[number].name if result["error"] is None else f"{wanted[number].name}: {result['error']}")
    results = [found[number] for number in range(len(wanted))]
    write_text(out / "suite.json", json.dumps(results, indent=1) + "\n")
    write_text(out / "suite.md", table(results))
    write_text(out / "suite.svg", plot(results))
    return results


def table(results: Sequence[dict[str, Any]]) -> str:
    """Write the medians over seeds by kind, habit and scan as a Markdown table."""
    lines = [
        f"| kind | habit | scan | trees | {' | '.join(FIGURES.values())} |",
        f"|---|---|---|---|{'---|' * len(FIGURES)}",
    ]
    for (kind, preset, name), group in _groups(results):
        cells = [_median(group, key) for key in FIGURES]
        scored = sum(result["error"] is None for result in group)
        count = f"{scored}" if scored == len(group) else f"{scored} of {len(group)}"
        lines.append(f"| {kind} | {preset} | {name} | {count} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def plot(results: Sequence[dict[str, Any]]) -> str:
    """Draw recall and precision of every case, a row per kind, habit and scan, as SVG."""
    groups = list(_groups(results))
    rows, left, wide = [], 250, 480
    for number, (names, group) in enumerate(groups):
        y = 40 + 18 * number
        rows.append(f'<text x="{left - 10}" y="{y + 4}" text-anchor="end">{escape(", ".join(names))}</text>')
        rows.append(f'<path d="M{left} {y}h{wide}" stroke="#ddd"/>')
        for key, colour in (("recall", "#2b7a3f"), ("precision", "#c06020")):
            rows += [
                f'<circle cx="{left + wide * result[key]:.1f}" cy="{y}" r="3.5" fill="{colour}" '
                f'fill-opacity="0.7"/>'
                for result in group
                if result["error"] is None and result[key] is not None
            ]
    high = 60 + 18 * len(groups)
    axis = "".join(
        f'<text x="{left + wide * share:.0f}" y="{high - 8}" text-anchor="middle">{share:g}</text>'
        for share in (0, 0.25, 0.5, 0.75, 1)
    )
    title = (
        f'<text x="{left}" y="18" fill="#2b7a3f">recall</text>'
        f'<text x="{left + 60}" y="18" fill="#c06020">precision</text>'
    )
    style = 'font-family="sans-serif" font-size="12"'
    size = f'width="{left + wide + 20}" height="{high}"'
    return f'<svg xmlns="http://www.w3.org/2000/svg" {size} {style}>{title}{"".join(rows)}{axis}</svg>\n'


def _groups(
    results: Sequence[dict[str, Any]],
) -> Iterator[tuple[tuple[str, str, str], list[dict[str, Any]]]]:
    groups: dict[tuple[str, str, str], list[dict[str, Any]]] = {}
    for result in results:
        groups.setdefault((result["kind"], result["preset"], result["scan"]), []).append(result)
    yield from groups.items()


def _median(group: Sequence[dict[str, Any]], key: str) -> str:
    known = [result[key] for result in group if result["error"] is None and result[key] is not None]
    if not known:
        return "-"
    middle = float(np.median(known))
    return (
        f"{middle:+.1f}"
        if key.endswith("_pct")
        else f"{middle:.1f}"
        if key.endswith("mm")
        else f"{middle:.2f}"
    )
