"""What each stage made and how long it took, so that nothing is made twice."""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter
from typing import Any, NamedTuple, TypeVar

from pipeline.options import Options

Made = TypeVar("Made")


class Artefact(NamedTuple):
    """One result with what it was made from."""

    function: Callable[..., Any]
    inputs: tuple[Any, ...]
    options: Options | None
    value: Any


class Store:
    """Artefacts of one tree in memory, and the seconds that each stage took.

    A stage runs again only when its function, one of its inputs or its options changed: keep the
    store between two calls of `reconstruct` to try other cylinder options on the same skeleton.

    Attributes
    ----------
    artefacts : dict of str to Artefact
    seconds : dict of str to float
    """

    def __init__(self) -> None:
        self.artefacts: dict[str, Artefact] = {}
        self.seconds: dict[str, float] = {}

    def remember(
        self, name: str, function: Callable[..., Made], *inputs: Any, options: Options | None = None
    ) -> Made:
        """Return ``function(*inputs, options=options)``, made now or kept from before.

        Parameters
        ----------
        name : str
            What the artefact and its seconds are called.
        function : callable
        *inputs
            Values that are never changed in place; the same object counts as the same input.
        options : Options, optional
            Left out of the call where None.
        """
        kept = self.artefacts.get(name)
        if kept and _same(kept, function, inputs, options):
            value: Made = kept.value
            return value
        chosen = {} if options is None else {"options": options}
        value = self.clock(name, function, *inputs, **chosen)
        self.artefacts[name] = Artefact(function, inputs, options, value)
        return value

    def clock(self, name: str, function: Callable[..., Made], *inputs: Any, **keywords: Any) -> Made:
        """Return what `function` makes; its seconds are added to those of `name`, nothing is kept."""
        start = perf_counter()
        try:
            return function(*inputs, **keywords)
        finally:
            self.seconds[name] = self.seconds.get(name, 0.0) + perf_counter() - start


def _same(kept: Artefact, function: Callable[..., Any], inputs: tuple[Any, ...], options: Any) -> bool:
    return (
        kept.function is function
        and len(kept.inputs) == len(inputs)
        and all(a is b for a, b in zip(kept.inputs, inputs, strict=True))
        and kept.options == options
    )
