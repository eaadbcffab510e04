"""One place for the compiler: `@compiled` is numba's njit with a cache, and keeps the types."""

from __future__ import annotations

from collections.abc import Callable
from typing import ParamSpec, TypeVar, cast

import numba

P = ParamSpec("P")
R = TypeVar("R")


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a plain-array function once and keep the machine code on disk.

    The Python original stays reachable as ``.py_func`` for the tests.
    """
    return cast("Callable[P, R]", numba.njit(cache=True, error_model="numpy")(function))
