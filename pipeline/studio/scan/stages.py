"""The stages from a file to what is shown: each is told, done elsewhere where it takes long, and kept."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Literal, ParamSpec, TypeVar

from pipeline.store import Store

P = ParamSpec("P")
R = TypeVar("R")

Stage = Literal["read", "clean", "skeleton", "fit", "sort", "distances", "compare"]

STAGES: Mapping[Stage, str] = {
    "read": "reading the file",
    "clean": "cleaning the points",
    "skeleton": "extracting the skeleton",
    "fit": "fitting cylinders",
    "sort": "telling leaves from wood",
    "distances": "measuring distances",
    "compare": "comparing the models",
}
"""What is done, in the order of the doing, in words."""

MAKING = ("clean", "skeleton", "fit")
"""Stages whose seconds are the report's."""

Caller = Callable[..., Any]
"""Calls a function somewhere, given what is called all the while: `Elsewhere.call`, or `at_once`."""


def at_once(function: Callable[P, R], wanted: Callable[[], None], *inputs: P.args, **named: P.kwargs) -> R:
    """Call a function in this process."""
    wanted()
    return function(*inputs, **named)


class Stages(Store):
    """A store that tells what it does, does it elsewhere, and knows what it did not do again."""

    def __init__(self, call: Caller) -> None:
        super().__init__()
        self._call = call
        self._told: Callable[[Stage], None] = lambda _stage: None
        self.made: list[str] = []

    def begin(self, told: Callable[[Stage], None]) -> None:
        """Begin to make something, and to tell somebody."""
        self._told, self.made = told, []

    def do(self, stage: Stage, function: Callable[P, R], *inputs: P.args, **named: P.kwargs) -> R:
        """Return what a function makes, told as a stage."""
        made: R = self._call(function, lambda: self._told(stage), *inputs, **named)
        return made

    def clock(self, name: str, function: Callable[..., R], *inputs: Any, **keywords: Any) -> R:
        """Do something elsewhere; its seconds are those of this time."""
        stage: Stage = name if name in STAGES else "sort"  # type: ignore[assignment]  # a key of STAGES
        self.seconds.pop(name, None)
        made: R = super().clock(name, self.do, stage, function, *inputs, **keywords)
        self.made.append(name)
        return made
