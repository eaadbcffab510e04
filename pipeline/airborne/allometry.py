"""The stem diameter of a tree seen from the air: rows of Jucker et al. by biome and kind of leaf."""

from __future__ import annotations

from typing import Literal, NamedTuple

from pydantic import Field

from pipeline.cylinders.allometry import GLOBAL, Allometry, allometric_diameter, allometric_interval
from pipeline.options import Options

Biome = Literal["unknown", "palearctic-temperate-mixed", "temperate-conifer"]
LeafType = Literal["unknown", "angiosperm", "gymnosperm"]

ROWS: dict[tuple[Biome, LeafType], Allometry] = {
    ("palearctic-temperate-mixed", "angiosperm"): Allometry(0.694, 0.730),
    ("palearctic-temperate-mixed", "gymnosperm"): Allometry(1.004, 0.730),
    ("temperate-conifer", "angiosperm"): Allometry(0.273, 0.927),
    ("temperate-conifer", "gymnosperm"): Allometry(0.974, 0.748),
}
"""Whatever is not here has the global row. On 103 trees of an Alpine plot the rows of the biome, by kind of
leaf, are off by +0.2 cm on average and 5.9 cm (21 %) root mean square; the global row by -2.3 and 6.9 cm."""


class AllometryOptions(Options):
    """What is known of the trees of an area."""

    biome: Biome = Field("unknown", description="where the trees grow; unknown has the global allometry")
    leaf_type: LeafType = Field(
        "unknown", description="broadleaves or conifers; unknown has the global allometry"
    )


class Diameter(NamedTuple):
    """A diameter at breast height and its 90 % interval, metres."""

    dbh_m: float
    lo_m: float
    hi_m: float


def row_of(biome: Biome = "unknown", leaf_type: LeafType = "unknown") -> Allometry:
    """Return the row of a biome and a kind of leaf; the global one where either is unknown."""
    return ROWS.get((biome, leaf_type), GLOBAL)


def breast_height_diameter(
    height_m: float, crown_m: float, *, options: AllometryOptions | None = None
) -> Diameter:
    """Diameter at breast height from a tree's height and crown diameter.

    Parameters
    ----------
    height_m, crown_m : float
        Metres.
    options : AllometryOptions, optional

    Returns
    -------
    Diameter

    References
    ----------
    Jucker et al. (2017), "Allometric equations for integrating remote sensing imagery into forest
    monitoring programmes", Global Change Biology 23, 177-190. The interval is our own: its standard
    deviation of 0.35 in the logarithm is more than the fits' residuals, for crowns are cut from points.

    Examples
    --------
    >>> mixed = AllometryOptions(biome="palearctic-temperate-mixed", leaf_type="angiosperm")
    >>> round(breast_height_diameter(15.0, 8.0, options=mixed).dbh_m, 3)
    0.229
    """
    options = options or AllometryOptions()
    diameter = allometric_diameter(height_m, crown_m, row_of(options.biome, options.leaf_type))
    return Diameter(diameter, *allometric_interval(diameter))
