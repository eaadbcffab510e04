"""What a night leaves behind: report.json, report.html, junit.xml and a line of history.jsonl."""

from __future__ import annotations

import json
import math
from html import escape
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from pipeline.errors import OutputError
from pipeline.output import write_text
from pipeline.regression.check import Check
from pipeline.regression.drawing import drawn
from pipeline.regression.nightly import Night, TreeNight
from pipeline.version import __version__

STATUSES = ("ok", "drift", "missing", "failed", "new")
DRAWN = 3
"""Trees that are drawn: those that have drifted most."""

STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; margin: 2rem auto; max-width: 62rem; padding: 0 1rem }
table { border-collapse: collapse; margin: 0.5rem 0 1.5rem } td, th { padding: 0.15rem 0.9rem 0.15rem 0 }
th { text-align: left; border-bottom: 1px solid #999 }
td.n { text-align: right; font-variant-numeric: tabular-nums }
.drift, .missing, .failed { color: #b00030; font-weight: 600 } .ok { color: #2b7a3f } .new { color: #36c }
svg { background: #fafafa; margin: 0.5rem 0 }
"""


def leave(night: Night, out: Path, *, when: str) -> None:
    """Write all four files into a folder.

    Parameters
    ----------
    night : Night
    out : Path
        Made if need be; history.jsonl gets one more line.
    when : str
        The time, as it shall be written.

    Raises
    ------
    OutputError
        If one cannot be written.
    """
    told = _told(night, when)
    write_text(out / "report.json", json.dumps(told, indent=2, ensure_ascii=False) + "\n")
    write_text(out / "report.html", _page(night, when))
    write_text(out / "junit.xml", _junit(night))
    _remember(told, out / "history.jsonl")


def sentence(tree: TreeNight) -> str:
    """Say in one line what became of a tree."""
    if tree.status == "drift" and tree.worst is not None:
        off = [check for check in tree.checks if not check.ok]
        most = sorted(off, key=lambda check: -check.severity)
        return (
            f"{tree.name}: drift: {'; '.join(map(_apart, most[:3]))}{', and more' if len(most) > 3 else ''}"
        )
    return f"{tree.name}: {tree.status}{f': {tree.message}' if tree.message else ''}"


def _told_of(tree: TreeNight) -> str:
    """Say the same without name and outcome."""
    return sentence(tree).removeprefix(f"{tree.name}: {tree.status}").removeprefix(": ")


def _apart(check: Check) -> str:
    if check.difference is None:
        return f"{check.measure} {_number(check.reference)} -> {_number(check.today)}"
    return (
        f"{check.measure} {_number(check.reference)} -> {_number(check.today)} "
        f"({check.difference:+.4g}, allowed {check.room:.3g})"
    )


def _told(night: Night, when: str) -> dict[str, Any]:
    return {
        "when": when,
        "version": __version__,
        "exit_code": night.exit_code,
        "counts": {status: sum(tree.status == status for tree in night.trees) for status in STATUSES},
        "trees": [
            {
                "name": tree.name,
                "status": tree.status,
                "message": tree.message,
                "severity": tree.severity if math.isfinite(tree.severity) else None,
                "checks": [check.to_dict() for check in tree.checks],
            }
            for tree in night.trees
        ],
    }


def _remember(told: dict[str, Any], path: Path) -> None:
    line = {key: told[key] for key in ("when", "version", "exit_code", "counts")}
    line["trees"] = {tree["name"]: tree["status"] for tree in told["trees"] if tree["status"] != "ok"}
    try:
        with path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(line, ensure_ascii=False) + "\n")
    except OSError as error:
        msg = f"{path}: cannot be written ({error.strerror}); choose another folder with --out"
        raise OutputError(msg) from error


def _junit(night: Night) -> str:
    bad, broken = night.of("drift", "missing"), night.of("failed")
    suite = ElementTree.Element(
        "testsuite",
        name="treepipe regress",
        tests=str(len(night.trees)),
        failures=str(len(bad)),
        errors=str(len(broken)),
    )
    for tree in night.trees:
        case = ElementTree.SubElement(suite, "testcase", classname="treepipe.regress", name=tree.name)
        if tree.status in ("drift", "missing", "failed"):
            kind = "error" if tree.status == "failed" else "failure"
            ElementTree.SubElement(case, kind, message=sentence(tree), type=tree.status)
        elif tree.status == "new":
            ElementTree.SubElement(case, "skipped", message=sentence(tree))
    ElementTree.indent(suite)
    return '<?xml version="1.0" encoding="utf-8"?>\n' + ElementTree.tostring(suite, encoding="unicode") + "\n"


def _page(night: Night, when: str) -> str:
    rows = "".join(
        f'<tr><td>{escape(tree.name)}</td><td class="{tree.status}">{tree.status}</td>'
        f"<td>{escape(_told_of(tree))}</td></tr>"
        for tree in night.trees
    )
    worst = sorted(night.of("drift"), key=lambda tree: -tree.severity)
    parts = "".join(_part(tree, number < DRAWN) for number, tree in enumerate(worst))
    green = "" if worst else "<p>No tree has drifted.</p>"
    return (
        f'<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>treepipe regress</title>'
        f"<style>{STYLE}</style></head><body><h1>Today against the references</h1>"
        f"<p>{escape(when)}, treepipe {escape(__version__)}</p>"
        f"<table><tr><th>tree</th><th></th><th></th></tr>{rows}</table>{green}{parts}</body></html>\n"
    )


def _part(tree: TreeNight, with_picture: bool) -> str:
    """Show a tree that has drifted: its picture, and every measure."""
    picture = ""
    if with_picture and tree.skeletons is not None:
        picture = (
            f"<p>From the south and from the east: grey then, coloured now, red where it has moved by 5 cm "
            f"or more.</p>{drawn(*tree.skeletons)}"
        )
    rows = "".join(
        f'<tr><td>{escape(check.measure)}</td><td class="n">{_number(check.reference)}</td>'
        f'<td class="n">{_number(check.today)}</td><td class="n">{_number(check.difference, "+")}</td>'
        f'<td class="n">{_number(check.room)}</td>'
        f'<td class="{"ok" if check.ok else "drift"}">{"ok" if check.ok else "drift"}</td></tr>'
        for check in tree.checks
    )
    head = "".join(f"<th>{name}</th>" for name in ("measure", "then", "now", "difference", "allowed", ""))
    return f"<h2>{escape(tree.name)}</h2>{picture}<table><tr>{head}</tr>{rows}</table>"


def _number(value: float | None, sign: str = "") -> str:
    return "unknown" if value is None else f"{value:{sign}.5g}"
