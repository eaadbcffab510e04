"""One place for the compiler: `@compiled` is numba's njit with a cache that cannot go stale."""

from __future__ import annotations

import hashlib
import os
import shutil
from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path
from typing import ParamSpec, TypeVar, cast

import numba

P = ParamSpec("P")
R = TypeVar("R")


KEPT_S = 7 * 86_400.0
"""How long machine code of other sources is kept; no run that began on them should last longer."""


def _cache_folder() -> Path | None:
    """Make a folder for machine code that belongs to exactly these sources, or None.

    numba looks at the file of a function alone and misses that a function it calls has changed, so
    the folder is named after all sources that hold compiled functions. Those of other sources are removed
    once nobody has used them for `KEPT_S`: a process that runs on older sources still writes into its own.
    """
    package = Path(__file__).resolve().parent.parent
    texts = [f.read_bytes() for f in sorted(package.rglob("*.py"))]
    place = hashlib.sha256(str(package).encode()).hexdigest()[:8]
    state = hashlib.sha256(b"".join(t for t in texts if b"@compiled" in t)).hexdigest()[:12]
    home = os.environ.get("NUMBA_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME") or "~/.cache"
    base = Path(home).expanduser() / "treepipe"
    folder = base / f"{place}-{state}"
    try:
        if folder.is_dir():
            with suppress(OSError):  # it may be somebody else's
                os.utime(folder)  # it is in use
        else:
            folder.mkdir(parents=True, exist_ok=True)
            _remove_unused(base.glob(f"{place}-*"), folder.stat().st_mtime)
    except (OSError, RuntimeError):
        return None
    return folder if os.access(folder, os.W_OK) else None


def _remove_unused(folders: Iterable[Path], now: float) -> None:
    for old in folders:
        with suppress(FileNotFoundError):  # another process removes it as well
            if now - old.stat().st_mtime > KEPT_S:
                shutil.rmtree(old, ignore_errors=True)


_FOLDER = _cache_folder()
if _FOLDER is not None:
    numba.config.CACHE_DIR = str(_FOLDER)  # type: ignore[attr-defined]  # made at run time


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a plain-array function once and keep the machine code on disk.

    The Python original stays reachable as ``.py_func`` for the tests.
    """
    compiler = numba.njit(cache=_FOLDER is not None, error_model="numpy")
    return cast("Callable[P, R]", compiler(function))
