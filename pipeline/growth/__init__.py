"""Trees that organise themselves: buds compete for light, and what it brings decides which of them grow.

| file | what |
|---|---|
| `options` | all parameters |
| `state` | the metamers: a piece of stem with two buds each |
| `simulation`, `log` | a year's growth, cuts, supports; what is told of them |
| `light`, `pyramid` | light by shadow: a grid of voxels that wood above darkens |
| `markers`, `jitter` | light by space: a grid of markers, one anywhere in each cell |
| `columns`, `views`, `claims` | the markers that buds see; each goes to the nearest of them |
| `poles` | parameters that would grow no branches |
| `lattice` | the grid of both |
| `sight` | what either tells of every bud |
| `shade` | neighbours and buildings |
| `allocation` | gathering light, sharing resource |
| `shoots`, `bound`, `chance` | which buds grow, where to, within what, and their chances |
| `shedding`, `widths` | branches that die, wood that thickens |
"""

from pipeline.growth.log import Entry, Removal, YearReport
from pipeline.growth.options import GrowthOptions
from pipeline.growth.poles import bare_pole
from pipeline.growth.shade import Shade
from pipeline.growth.simulation import (
    BarePoleWarning,
    Event,
    Growth,
    Support,
    grow,
)
from pipeline.growth.state import DAMAGED, DORMANT, GROWN, Metamers

__all__ = [
    "DAMAGED",
    "DORMANT",
    "GROWN",
    "BarePoleWarning",
    "Entry",
    "Event",
    "Growth",
    "GrowthOptions",
    "Metamers",
    "Removal",
    "Shade",
    "Support",
    "YearReport",
    "bare_pole",
    "grow",
]
