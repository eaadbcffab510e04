"""Undo and redo: the values of the past, the present one, and those that were undone."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Generic, TypeVar

T = TypeVar("T")

MOST = 200  # values that can be undone; older ones are forgotten


@dataclass(frozen=True)
class History(Generic[T]):
    """Values in the order of their making, and where in them the present is.

    Parameters
    ----------
    present : T
    past, undone : tuple of T, optional
        Before and after the present one, in order.
    gesture : str or None, optional
        What made the present value, while it goes on; such as the slider that is being dragged.

    Examples
    --------
    >>> history = History(1).record(2).record(3)
    >>> history.undo().present, history.undo().undo().redo().present
    (2, 2)
    """

    present: T
    past: tuple[T, ...] = ()
    undone: tuple[T, ...] = ()
    gesture: str | None = None

    def record(self, value: T, gesture: str | None = None) -> History[T]:
        """Make a value the present one; what was undone is gone.

        While one gesture goes on its values count as one. The value there is already is no new one.
        """
        if value == self.present:
            return self
        if gesture is not None and gesture == self.gesture:
            return replace(self, present=value)
        before = self.settled()
        return History(value, (*before.past, before.present)[-MOST:], (), gesture)

    def settled(self) -> History[T]:
        """End a gesture; one that ends where it began leaves no trace."""
        if self.gesture is not None and self.past and self.past[-1] == self.present:
            return History(self.present, self.past[:-1])
        return replace(self, gesture=None)

    def undo(self) -> History[T]:
        """Go back by one value; at the first one nothing changes."""
        here = self.settled()
        if not here.past:
            return here
        return History(here.past[-1], here.past[:-1], (here.present, *here.undone))

    def redo(self) -> History[T]:
        """Take the last undo back; where there is none nothing changes."""
        if not self.undone:
            return self.settled()
        return History(self.undone[0], (*self.past, self.present), self.undone[1:])
