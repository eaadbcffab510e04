"""The parameters of growth that have a slider or a choice; the others come with a species or a file."""

from __future__ import annotations

import math
from typing import Any, NamedTuple, get_args

from pipeline.growth import GrowthOptions
from pipeline.toml import allowed


class Slider(NamedTuple):
    """A parameter of growth as the page shows it.

    Attributes
    ----------
    name, label : str
    low, high, step : float
        Of the slider; the parameter itself may have a wider range.
    unit : str
    """

    name: str
    label: str
    low: float
    high: float
    step: float
    unit: str = ""

    @property
    def sentence(self) -> str:
        """What it is, with its range."""
        field = GrowthOptions.model_fields[self.name]
        return f"{field.description}; {allowed(field)}"

    @property
    def key(self) -> str:
        """The state variable of the page."""
        return f"years_{self.name}"


SLIDERS = (
    Slider("alpha", "Vigour (alpha)", 1.0, 5.0, 0.05),
    Slider("dominance", "Dominance of the stem", 0.40, 0.65, 0.005),
    Slider("metamer_m", "Length of a metamer", 0.03, 0.30, 0.005, "m"),
    Slider("insertion_deg", "Angle of side branches", 20.0, 100.0, 1.0, "°"),
    Slider("light_weight", "Pull of the light", 0.0, 1.0, 0.01),
    Slider("vertical_weight", "Pull upwards", -0.5, 0.5, 0.01),
    Slider("bud_weight", "Pull of the bud", 0.0, 1.0, 0.01),
    Slider("shade", "Shade of a metamer", 0.0, 1.0, 0.01),
    Slider("shed_threshold", "Light below which branches die", 0.0, 0.6, 0.01),
    Slider("tip_radius_m", "Radius of a shoot", 0.001, 0.010, 0.0005, "m"),
)
CHOICES = {"light": "Light", "allocation": "Sharing of resource"}


def choices_of(name: str) -> list[str]:
    """Return the values of a choice."""
    return list(get_args(GrowthOptions.model_fields[name].annotation))


def number_of(value: Any, *, whole: bool = False) -> int | float | None:
    """Return a value of the browser without the dust of its steps; None where it is no number."""
    if isinstance(value, str):
        try:
            value = float(value)
        except ValueError:
            return None
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        return None
    return round(value) if whole else round(float(value), 5)
