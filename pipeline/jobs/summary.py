"""What became of every tree, and summary.json."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from pipeline.output import write_text
from pipeline.version import __version__


@dataclass(frozen=True)
class Outcome:
    """What became of one tree.

    Parameters
    ----------
    name, path : str
        As in the input.
    seconds : float
        From reading to the last file.
    error : str or None
        Why there is no model, one sentence; None where there is one.
    trace : str or None
        Where an unexpected error comes from, for the programmer.
    warnings : tuple of str
        What is missing though the model is there, such as a picture.
    figures : mapping
        The report, as in report.json; empty where there is none.
    """

    name: str
    path: str
    seconds: float
    error: str | None = None
    trace: str | None = None
    warnings: tuple[str, ...] = ()
    figures: Mapping[str, Any] = field(default_factory=dict)

    @property
    def status(self) -> Literal["ok", "failed"]:
        """Whether there is a model."""
        return "ok" if self.error is None else "failed"


def summary(outcomes: Sequence[Outcome], seconds: float) -> dict[str, Any]:
    """Return the content of summary.json: a line per input, in their order, and the counts."""
    failed = sum(outcome.error is not None for outcome in outcomes)
    return {
        "inputs": [
            {
                "name": outcome.name,
                "path": outcome.path,
                "status": outcome.status,
                "error": outcome.error,
                "seconds": round(outcome.seconds, 3),
            }
            for outcome in outcomes
        ],
        "ok": len(outcomes) - failed,
        "failed": failed,
        "seconds": round(seconds, 3),
        "version": __version__,
    }


def write_summary(outcomes: Sequence[Outcome], seconds: float, path: Path) -> None:
    """Write summary.json.

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    write_text(path, json.dumps(summary(outcomes, seconds), indent=2, ensure_ascii=False) + "\n")
