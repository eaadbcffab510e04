"""A model that has grown says so in its LsJSON; one that was measured holds no word of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pipeline.errors import InputFormatError
from pipeline.growth import GrowthOptions
from pipeline.lsystem import decode, encode, read_lsjson, write_lsjson
from pipeline.lsystem.transforms.growing import ScaleOptions, grow
from pipeline.model import ALLOMETRIC, MEASURED, PROPAGATED, Skeleton, TreeModel, Trunk
from pipeline.run import grow_on


@pytest.fixture
def pole() -> TreeModel:
    """Four metres of measured wood."""
    xyz = np.column_stack([np.zeros(9), np.zeros(9), np.linspace(0.0, 4.0, 9)])
    radius, source = np.linspace(0.02, 0.004, 9), np.full(9, MEASURED, dtype=np.uint8)
    trunk = Trunk(0.03, 0.028, 0.032, 300.0, "measured", 0.0)
    return TreeModel(
        Skeleton(xyz, np.arange(-1, 8)), radius, source, np.full(9, np.nan), trunk, {"flags": ("sparse",)}
    )


def test_a_measured_model_has_no_growth(pole: TreeModel) -> None:
    document = encode(pole)
    assert "growth" not in document
    assert "growth" not in decode(document).metadata
    assert "growth" not in encode(grow_on(pole, GrowthOptions(), 0, seed=1))


def test_an_organic_model_tells_how_it_grew(pole: TreeModel, tmp_path: Path) -> None:
    grown = grow_on(pole, GrowthOptions(), 4, seed=7)
    write_lsjson(encode(grown), tmp_path / "grown.ls.json")
    document = read_lsjson(tmp_path / "grown.ls.json")
    again = decode(document)
    assert document["growth"] == {**grown.metadata["growth"], "events": []}
    assert again.metadata["growth"] == grown.metadata["growth"]
    assert again.metadata["flags"] == ("grown",)
    assert encode(again) == document
    young = again.skeleton.world[:, 2] > 4.0 + 1e-6
    assert young.any()
    assert (again.radius_source[young] == ALLOMETRIC).all()
    assert again.trunk is not None
    assert again.trunk.source == "allometric"


def test_a_scaled_model_tells_how_it_grew(pole: TreeModel) -> None:
    document = grow(encode(pole), years=2, options=ScaleOptions(speed=0.1, thickness=0.1))
    assert document["growth"] == {"method": "scale", "years": 2}
    assert set(decode(document).radius_source.tolist()) == {PROPAGATED}
    twice = grow(document, years=1, options=ScaleOptions(speed=0.1))
    assert twice["growth"]["before"] == {"method": "scale", "years": 2}
    assert "growth" not in grow(encode(pole), years=2)


def test_growth_must_be_an_object(pole: TreeModel) -> None:
    with pytest.raises(InputFormatError, match=r"not an LsJSON: growth: .*mend it"):
        decode({**encode(pole), "growth": 5})
