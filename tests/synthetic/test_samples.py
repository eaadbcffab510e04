"""The trees in data/samples are those of the generator, small enough to ship."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pipeline.cloud import read_cloud
from pipeline.synthetic import read_truth, truth_of
from pipeline.synthetic.samples import SAMPLES, make, write_samples


@pytest.mark.parametrize("name", SAMPLES)
def test_a_shipped_sample_is_what_the_generator_makes(name: str, samples: Path) -> None:
    tree, cloud = make(name)
    shipped = read_cloud(samples / f"{name}.laz")
    assert len(shipped) == len(cloud)
    assert shipped.crs == cloud.crs == SAMPLES[name].crs
    difference = np.sort(shipped.world, axis=0) - np.sort(cloud.world, axis=0)
    assert np.abs(difference).max() < 0.0006
    truth, expected = read_truth(samples / f"{name}.truth.npz"), truth_of(tree)
    np.testing.assert_array_equal(truth.parent, expected.parent)
    np.testing.assert_allclose(truth.e, expected.e, atol=1e-6)
    np.testing.assert_allclose(truth.r, expected.r, atol=1e-6)


def test_samples_are_small(samples: Path) -> None:
    sizes = [path.stat().st_size for path in samples.iterdir()]
    assert max(sizes) < 1_000_000
    assert sum(sizes) < 3_000_000


def test_the_same_bytes_every_time(tmp_path: Path) -> None:
    first, second = write_samples(tmp_path / "a"), write_samples(tmp_path / "b")
    assert len(first) == 2 * len(SAMPLES)
    for one, two in zip(first, second, strict=True):
        assert one.read_bytes() == two.read_bytes()


def test_truth_and_cloud_share_their_coordinates(samples: Path) -> None:
    truth, cloud = read_truth(samples / "maple.truth.npz"), read_cloud(samples / "maple.laz")
    assert truth.s[0] == pytest.approx([120000.0, 487000.0, 1.25])
    low, high = cloud.world.min(axis=0), cloud.world.max(axis=0)
    assert (truth.e.min(axis=0) > low - 0.05).all()
    assert (truth.e.max(axis=0) < high + 0.05).all()


def test_the_readme_tells_how_many_points(samples: Path) -> None:
    text = (samples / "README.md").read_text(encoding="utf-8")
    for name in SAMPLES:
        assert f"| {len(make(name)[1]):,} " in text, name
