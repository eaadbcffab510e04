"""What kind of crown is fitted: its width, and whether its points can be taken for bark."""

from __future__ import annotations

from dataclasses import dataclass

SPARSE_M = 0.07  # median distance of neighbouring points beyond which slices of bark fall apart
LEAFY = 0.27  # share of linear neighbourhoods below which leaves hide the wood


@dataclass(frozen=True)
class Crown:
    """A tree's crown as a whole.

    Parameters
    ----------
    diameter_m : float
        Of the circle with the area of the points' convex hull in plan, metres.
    leafy, sparse : bool
        Whether leaves, or too few points, keep the bark from showing.
    """

    diameter_m: float
    leafy: bool
    sparse: bool

    @property
    def shows_bark(self) -> bool:
        """Whether a radius may be believed where the points do not look like a shell."""
        return not (self.leafy or self.sparse)
