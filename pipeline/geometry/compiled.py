"""One place for the compiler: `@compiled` is numba's njit with a cache that cannot go stale."""

from __future__ import annotations

import hashlib
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import ParamSpec, TypeVar, cast

import numba

P = ParamSpec("P")
R = TypeVar("R")


def _cache_folder() -> Path | None:
    """Make a folder for machine code that belongs to exactly these sources, or None.

    numba looks at the file of a function alone and misses that a function it calls has changed, so
    the folder is named after all sources that hold compiled functions; that of the sources before is removed.
    """
    package = Path(__file__).resolve().parent.parent
    texts = [f.read_bytes() for f in sorted(package.rglob("*.py"))]
    place = hashlib.sha256(str(package).encode()).hexdigest()[:8]
    state = hashlib.sha256(b"".join(t for t in texts if b"@compiled" in t)).hexdigest()[:12]
    home = os.environ.get("NUMBA_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME") or "~/.cache"
    base = Path(home).expanduser() / "treepipe"
    folder = base / f"{place}-{state}"
    try:
        if not folder.is_dir():
            for old in base.glob(f"{place}-*"):
                shutil.rmtree(old, ignore_errors=True)
            folder.mkdir(parents=True, exist_ok=True)
    except (OSError, RuntimeError):
        return None
    return folder if os.access(folder, os.W_OK) else None


_FOLDER = _cache_folder()
if _FOLDER is not None:
    numba.config.CACHE_DIR = str(_FOLDER)  # type: ignore[attr-defined]  # made at run time


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a plain-array function once and keep the machine code on disk.

    The Python original stays reachable as ``.py_func`` for the tests.
    """
    compiler = numba.njit(cache=_FOLDER is not None, error_model="numpy")
    return cast("Callable[P, R]", compiler(function))
