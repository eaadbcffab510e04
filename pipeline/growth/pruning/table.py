"""All operations by name: a new one is one line here."""

from __future__ import annotations

from pipeline.growth.pruning.crown import CrownRaise, Reduce, Thin
from pipeline.growth.pruning.cutting import CutToBud, LimitLength
from pipeline.growth.pruning.espalier import Espalier
from pipeline.growth.pruning.facing import FacingBud, Outward
from pipeline.growth.pruning.guiding import BendAndTie, Stake
from pipeline.growth.pruning.opening import OpenCentre
from pipeline.growth.pruning.operation import Operation

OPERATIONS: dict[str, type[Operation]] = {
    operation.name: operation
    for operation in (
        CutToBud,
        FacingBud,
        Outward,
        Stake,
        OpenCentre,
        Espalier,
        LimitLength,
        CrownRaise,
        Thin,
        Reduce,
        BendAndTie,
    )
}
"""Operations by the name that files and the command line use."""
