"""The one sentence for a file that breaks off or is not what its suffix says."""

from __future__ import annotations

from pathlib import Path

from pipeline.errors import InputFormatError

REMEDY = "copy or export it again, and check that its suffix says what it is"


def damaged(path: Path, kind: str, reason: object) -> InputFormatError:
    """Return the error for a `path` that cannot be read as `kind` ("LAZ file", ...)."""
    what = str(reason).partition("\n")[0]  # some libraries write whole reports
    return InputFormatError(f"{path}: cannot be read as a {kind} ({what}); {REMEDY}")
