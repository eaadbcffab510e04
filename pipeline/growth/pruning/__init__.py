"""Pruning: what a gardener does to a tree, as operations on a `Growth`.

| operation | what it does | file |
|---|---|---|
| cut-to-bud | cut wood off, just above a bud | `cutting` |
| limit-length | keep branches within a length | `cutting` |
| facing-bud | cut to the bud nearest the middle that looks a given way | `facing` |
| outward | the same, away from the stem | `facing` |
| stake | tie axes to a stake at any angle | `guiding` |
| bend-and-tie | bend young wood, and tie it there | `guiding` |
| open-centre | cut the leader above its third side branch | `opening` |
| crown-raise | clear the stem up to a height | `crown` |
| reduce | cut back to an envelope | `crown` |
| thin | take out the branches with the least light | `crown` |
| espalier | tiers of level arms along a wall | `espalier` |

An operation is a frozen model of its parameters, and of the branches that it is for (`selecting`). Its
``apply`` takes a `Growth`, changes the tree, and returns what is in the log then. A new operation is one
class and one entry in `OPERATIONS`.

References
----------
The first eight are of a Dutch thesis on pruning in self-organising growth (after Brickell & Joyce), or what
it finds missing; the last of its sections 4.3 and 6.1.
"""

from pipeline.growth.pruning.crown import CrownRaise, Reduce, Thin
from pipeline.growth.pruning.cutting import CutToBud, LimitLength
from pipeline.growth.pruning.espalier import Espalier
from pipeline.growth.pruning.facing import FacingBud, Outward
from pipeline.growth.pruning.guiding import BendAndTie, Stake
from pipeline.growth.pruning.naming import operation_of
from pipeline.growth.pruning.opening import OpenCentre
from pipeline.growth.pruning.operation import Operation, Pruned
from pipeline.growth.pruning.selecting import Selector
from pipeline.growth.pruning.table import OPERATIONS

__all__ = [
    "OPERATIONS",
    "BendAndTie",
    "CrownRaise",
    "CutToBud",
    "Espalier",
    "FacingBud",
    "LimitLength",
    "OpenCentre",
    "Operation",
    "Outward",
    "Pruned",
    "Reduce",
    "Selector",
    "Stake",
    "Thin",
    "operation_of",
]
