"""A small tree with known truth, its cloud, and a folder with clouds that are none."""

from __future__ import annotations

import json

import numpy as np
import pytest

from pipeline.cloud import write_cloud
from pipeline.model import PointCloud
from pipeline.synthetic import SampleOptions, TubeTreeOptions, grow_tubes, sample, truth_of, write_truth

BROKEN = {
    "empty.laz": b"",
    "three.xyz": b"0 0 0\n0 0 1\n0.1 0 2\n",
    "words.txt": b"this is no cloud\n",
    "cut.laz": b"LASF" + bytes(200),
    "torn.ls.json": b'{"x": 1',
}
"""Files that cannot be opened."""


@pytest.fixture(scope="session")
def grown():
    return grow_tubes(TubeTreeOptions(seed=5, height_m=3.0, trunk_radius_m=0.06, max_order=1))


@pytest.fixture(scope="session")
def cloud(grown):
    return sample(
        grown, options=SampleOptions(seed=5, density_per_m2=3000, noise_m=0.002, ground_radius_m=1.0)
    )


@pytest.fixture(scope="session")
def folder(tmp_path_factory, grown, cloud):
    """A folder with twig.laz, its truth, a plane, ground apart, a cloud without classes, broken files."""
    made = tmp_path_factory.mktemp("scan")
    write_cloud(cloud, made / "twig.laz")
    write_truth(truth_of(grown), made / "twig.truth.npz")
    plane = np.column_stack([np.random.default_rng(1).random((500, 2)), np.zeros(500)])
    write_cloud(PointCloud(plane), made / "plane.laz")
    write_cloud(PointCloud(cloud.xyz), made / "bare.laz")
    around = np.random.default_rng(2).uniform(-3.0, 3.0, (3000, 2))
    write_cloud(PointCloud(np.column_stack([around, np.full(3000, -0.05)])), made / "floor.laz")
    for name, content in BROKEN.items():
        (made / name).write_bytes(content)
    return made


@pytest.fixture
def run_folder(folder, tmp_path):
    """Return what makes a folder of a run of twig.laz."""
    from pipeline.config import Config
    from pipeline.jobs.inputs import Input
    from pipeline.jobs.reconstruction import Reconstruction

    config = Config().with_settings(["cylinders.rounds=1"])
    work = Reconstruction(tmp_path / "out", config, ("lsjson",), picture=False)
    work.prepare()
    outcome = work(Input("twig", folder / "twig.laz"))
    assert outcome.error is None
    (tmp_path / "out" / "config.toml").write_text(config.to_toml())
    made = tmp_path / "out" / "twig"
    assert json.loads((made / "report.json").read_text())["name"] == "twig"
    return made
