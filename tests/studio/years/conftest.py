"""A standing tree far from the zero of coordinates, and what grows plans."""

from dataclasses import replace
from itertools import count

import pytest

from pipeline.exchange import write
from pipeline.growth import GrowthOptions, grow
from pipeline.model import Skeleton, TreeModel
from pipeline.studio.years.forms import programme_from
from pipeline.studio.years.growing import Grower
from pipeline.studio.years.plan import Plan

FAR = (121_913.0, 487_434.0, 2.5)


@pytest.fixture(scope="session")
def standing():
    """A tree of ten years, as if it had been scanned."""
    grown = grow(GrowthOptions(), 10, seed=4).to_model()
    held = grown.skeleton
    graph = Skeleton(held.xyz, held.parent, FAR, "EPSG:28992")
    return TreeModel(graph, grown.radius, 0 * grown.radius_source, 0.001 + 0 * grown.radius)


@pytest.fixture(scope="session")
def standing_file(standing, tmp_path_factory):
    path = tmp_path_factory.mktemp("years") / "oak.npz"
    write(standing, path)
    return path


@pytest.fixture
def grower():
    ticks = count()
    return Grower(lambda: float(next(ticks)))


@pytest.fixture
def event():
    """Return what makes an event as the form does."""
    return lambda operation, **values: programme_from(operation, values)


@pytest.fixture
def plan():
    """Return what makes a short plan; all of a test begin with the same bud."""
    short = Plan(years=8, seed=3)
    return lambda **values: replace(short, **values)
