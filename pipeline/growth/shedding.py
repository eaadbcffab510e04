"""Side branches that bring too little light for their size die."""

from __future__ import annotations

import numpy as np

from pipeline.growth.allocation import Gathered
from pipeline.growth.options import LimitOptions
from pipeline.growth.state import Metamers
from pipeline.model import Ints


def shaded_out(tree: Metamers, light: Gathered, year: int, options: LimitOptions) -> Ints:
    """Return the first metamers of side branches with too little light, of those older than this year.

    Parameters
    ----------
    tree : Metamers
        May have grown shoots since the light was gathered.
    light : Gathered
    year : int
    options : LimitOptions
    """
    rows = slice(0, len(light.internodes))
    mean = (light.terminal + light.lateral) / light.internodes
    dies = tree.is_lateral[rows] & (tree.birth_year[rows] < year) & (mean < options.shed_threshold)
    return np.flatnonzero(dies).astype(np.int32)
