"""A small cloud with known truth, and the command as a user calls it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from pipeline.cli.main import main
from pipeline.synthetic import SampleOptions, TubeTreeOptions, grow_tubes, sample


@pytest.fixture(scope="session")
def points():
    """(P, 3) points on a sapling of a dozen branches."""
    tree = grow_tubes(TubeTreeOptions(height_m=3, trunk_radius_m=0.06, max_order=1, branch_spacing_m=0.25))
    cloud = sample(tree, options=SampleOptions())
    return np.round(cloud.world[:: max(1, len(cloud) // 3000)], 4)


@pytest.fixture(scope="session")
def sapling(points, tmp_path_factory) -> Path:
    """A text file of these points."""
    return save(tmp_path_factory.mktemp("clouds") / "sapling.xyz", points)


@pytest.fixture(scope="session")
def made(sapling, tmp_path_factory) -> Path:
    """The folder that `treepipe run` has made of them."""
    out = tmp_path_factory.mktemp("made") / "out"
    result = treepipe("run", sapling, "--out", out, "--no-picture")
    assert result.exit_code == 0, result.output
    return out


def save(path: Path, points) -> Path:
    np.savetxt(path, points, fmt="%.4f")
    return path


def treepipe(*arguments: object) -> Result:
    """Call the command in this process."""
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


@pytest.fixture
def call():
    return treepipe


@pytest.fixture
def run(tmp_path):
    """Call `treepipe run` on some inputs; the folder is ``tmp_path / "out"``."""
    return lambda *arguments: treepipe("run", *arguments, "--out", tmp_path / "out", "--no-picture")
