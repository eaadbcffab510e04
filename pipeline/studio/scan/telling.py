"""What the page says of a result, as the values of its state."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pipeline.exchange import FORMATS
from pipeline.model import TreeModel
from pipeline.studio.history import History
from pipeline.studio.scan.beside import command_of
from pipeline.studio.scan.colouring import MODES, graph_of, modes_of
from pipeline.studio.scan.fields import FIELDS, values_of
from pipeline.studio.scan.figures import compared, flags, rows
from pipeline.studio.scan.listing import Entry
from pipeline.studio.scan.making import Shown
from pipeline.studio.scan.scene import LAYERS, Drawn
from pipeline.studio.scan.session import ScanSession
from pipeline.studio.scan.stages import STAGES

NOTHING = "nothing"
"""What is compared with at first."""

START: dict[str, Any] = {
    **{f"scan_show_{name}": name != "rest" for name in LAYERS},
    **{f"{field.state}_choices": list(field.choices) for field in FIELDS if field.choices},
    "scan_busy": False,
    "scan_progress": 0,
    "scan_doing": "",
    "scan_shown": 0,
    "scan_line": "",
    "scan_has": dict.fromkeys(LAYERS, False),
    "scan_mode": "height",
    "scan_modes": [{"title": words, "value": mode} for mode, words in MODES.items()],
    "scan_legends": [],
    "scan_chosen": None,
    "scan_entries": [],
    "scan_others": [],
    "scan_against": NOTHING,
    "scan_together": "over",
    "scan_aligned": False,
    "scan_all_methods": False,
    "scan_method": "",
    "scan_cloud": False,
    "scan_tree": False,
    "scan_stem": "",
    "scan_from": "",
    "scan_other": "",
    "scan_notes": [],
    "scan_rows": [],
    "scan_flags": [],
    "scan_tables": [],
    "scan_grounds": [],
    "scan_ground": NOTHING,
    "scan_crs": "",
    "scan_species": "",
    "scan_command": "",
    "scan_format": "lsjson",
    "scan_suffixes": {name: kind.suffix for name, kind in FORMATS.items()},
}
"""The state before anything is opened."""


def options_of(session: ScanSession) -> dict[str, Any]:
    """Return what the form of the options shows."""
    history = session.history or History(session.config)
    steps = {"scan_can_undo": bool(history.past), "scan_can_redo": bool(history.undone)}
    return {**values_of(session.config), **steps}


def files_of(session: ScanSession, numbers: Mapping[Path, int]) -> dict[str, Any]:
    """Return what the form shows of files and of what is known beside the points, given their numbers."""
    beside, against = session.beside, session.against
    other = numbers.get(against) if isinstance(against, Path) else against
    return {
        "scan_against": NOTHING if other is None else other,
        "scan_chosen": None if session.path is None else numbers.get(session.path),
        "scan_ground": NOTHING if beside.ground is None else numbers.get(beside.ground, NOTHING),
        "scan_crs": beside.crs or "",
        "scan_species": beside.species or "",
    }


def lists_of(found: Sequence[Entry]) -> dict[str, Any]:
    """Return what there is to choose from: to open, as points of the ground, and to compare with."""
    named = [{"title": f"{each.kind}: {each.label}", "value": number} for number, each in enumerate(found)]
    models, clouds = (
        [one for one, each in zip(named, found, strict=True) if each.kind == kind]
        for kind in ("model", "cloud")
    )
    earlier = [
        {"title": "nothing", "value": NOTHING},
        {"title": "the result before the last change", "value": "before"},
        {"title": "the result at the start", "value": "start"},
    ]
    return {
        "scan_entries": named,
        "scan_grounds": [{"title": "in the cloud, or found", "value": NOTHING}, *clouds],
        "scan_others": [*earlier, *models],
    }


def result_of(shown: Shown) -> dict[str, Any]:
    """Return what the panel tells of a result."""
    result, opened = shown.result, shown.opened
    return {
        "scan_stem": opened.name,
        "scan_from": _from(shown),
        "scan_cloud": opened.cloud is not None,
        "scan_command": _command(shown),
        "scan_tree": isinstance(result.tree, TreeModel),
        "scan_method": str(result.figures.get("method") or ""),
        "scan_modes": [{"title": MODES[mode], "value": mode} for mode in modes_of(result)],
        "scan_notes": list(opened.notes),
        "scan_rows": [list(row) for row in rows(result.figures)],
        "scan_flags": flags(result.figures),
        "scan_tables": [] if shown.compared is None else compared(shown.compared),
        "scan_other": "" if shown.other is None else _other(shown),
    }


def picture_of(shown: Shown, drawn: Drawn, has: dict[str, bool]) -> dict[str, Any]:
    """Return what stands over and below the picture."""
    parts = [f"{len(graph_of(shown.result.tree)):,} nodes"]
    if drawn.points:
        few = f"every {drawn.points / drawn.shown:.1f}th point is drawn, {drawn.shown:,} of {drawn.points:,}"
        all_ = f"all {drawn.points:,} points are drawn"
        parts.append(all_ if drawn.shown == drawn.points else f"{few}; figures are of all")
    if shown.result.stages:
        made = [stage for stage in ("clean", "skeleton", "fit") if stage in shown.result.stages]
        kept = [stage for stage in ("clean", "skeleton", "fit") if stage not in shown.result.stages]
        parts.append(f"made: {', '.join(made) or 'nothing'}" + (f"; kept: {', '.join(kept)}" if kept else ""))
    return {
        "scan_has": has,
        "scan_legends": [legend.to_dict() for legend in drawn.legends],
        "scan_line": " · ".join(parts),
    }


def progress_of(stage: str, seconds: float) -> dict[str, Any]:
    """Return what is said while a stage goes on."""
    took = f", {seconds:.0f} s" if seconds >= 1 else ""
    long = f" ({COMPILED})" if seconds > LONG_S else ""
    words = next(words for name, words in STAGES.items() if name == stage)
    share = 100 * [*STAGES].index(stage) // len(STAGES)  # type: ignore[arg-type]  # one of them
    return {"scan_busy": True, "scan_progress": share, "scan_doing": f"{words}{took}{long}"}


LONG_S = 8.0
COMPILED = "the first time after an installation it is compiled, which takes a minute or two"


def _command(shown: Shown) -> str:
    """Return the command that makes the same model, where there are points."""
    if shown.opened.cloud is None:
        return ""
    path = Path(dict(shown.opened.cloud.metadata["source"])["path"])
    return command_of(path, shown.opened.name, shown.wish.beside)


def _from(shown: Shown) -> str:
    """Say what the figures are of."""
    opened = shown.opened
    if opened.written is not None and shown.result.figures is opened.written:
        return f"as the run has written it: {opened.path.name}"
    if opened.cloud is None:
        return f"the model of {opened.path.name}"
    return f"reconstructed from {Path(dict(opened.cloud.metadata['source'])['path']).name}"


def _other(shown: Shown) -> str:
    against = shown.wish.other
    if isinstance(against, Path):
        return against.name
    return (
        "the result with the options at the start" if against == shown.opened.config else "the result before"
    )
