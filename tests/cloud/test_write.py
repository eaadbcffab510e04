"""Writing clouds: what is written comes back, and the same cloud gives the same bytes."""

from __future__ import annotations

from pathlib import Path

import laspy
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from lazrs import LazrsError

from pipeline.cloud import read_cloud, write_cloud
from pipeline.cloud.notes import frozen, plain
from pipeline.errors import OutputError, UsageError
from pipeline.model import PointCloud

RNG = np.random.default_rng(5)
XYZ = np.round(RNG.random((1000, 3)) * [40, 40, 25] - [10, 10, 1], 5)


def cloud(**changes: object) -> PointCloud:
    known: dict[str, object] = {
        "xyz": XYZ,
        "origin": np.array([120000.5, 487000.0, -2.0]),
        "crs": "EPSG:28992",
        "attributes": {
            "classification": np.arange(1000, dtype=np.uint8) % 20,
            "return_number": np.full(1000, 2),
            "withheld": np.arange(1000) % 7 == 0,
            "leaf": np.arange(1000) % 2 == 0,
            "probability": XYZ[:, 0].astype(np.float32),
            "normal": np.sin(XYZ),
        },
        "metadata": {"flags": ("leafy", "sparse"), "ground_z": np.float64(0.25), "crs_assumed": True},
    }
    return PointCloud(**(known | changes))  # type: ignore[arg-type]  # the keys are the class's own


@pytest.mark.parametrize("name", ["tree.laz", "tree.las", "TREE.LAZ"])
def test_what_is_written_comes_back(tmp_path: Path, name: str) -> None:
    there = cloud()
    write_cloud(there, tmp_path / name)
    back = read_cloud(tmp_path / name)
    np.testing.assert_array_equal(np.rint(back.xyz * 1e5), np.rint(XYZ * 1e5))
    np.testing.assert_allclose(back.xyz, XYZ, rtol=0, atol=1e-9)
    assert back.origin.tolist() == there.origin.tolist()
    assert back.crs == "EPSG:28992"
    assert list(back.attributes) == list(there.attributes)
    for key, values in there.attributes.items():
        np.testing.assert_array_equal(back.attributes[key], values)
    assert back.attributes["leaf"].dtype == bool
    assert dict(back.metadata) == {"source": back.metadata["source"], **there.metadata}


def test_the_same_cloud_gives_the_same_bytes(tmp_path: Path) -> None:
    for name in ("a.laz", "b.laz"):
        write_cloud(cloud(), tmp_path / name)
    assert (tmp_path / "a.laz").read_bytes() == (tmp_path / "b.laz").read_bytes()
    write_cloud(read_cloud(tmp_path / "a.laz"), tmp_path / "c.laz")
    write_cloud(read_cloud(tmp_path / "c.laz"), tmp_path / "d.laz")
    assert (tmp_path / "c.laz").read_bytes() == (tmp_path / "d.laz").read_bytes()


def test_the_file_is_plain_las_for_others(tmp_path: Path) -> None:
    write_cloud(cloud(), tmp_path / "tree.laz")
    las = laspy.read(tmp_path / "tree.laz")
    assert (las.header.version.minor, las.header.point_format.id) == (4, 6)
    assert las.header.global_encoding.wkt
    assert las.header.scales.tolist() == [1e-7] * 3
    np.testing.assert_allclose(las.xyz, cloud().world, rtol=0, atol=1e-6)


@pytest.mark.parametrize("crs", ["EPSG:28992", "EPSG:7415", "EPSG:4978", None])
def test_reference_systems_come_back(tmp_path: Path, crs: str | None) -> None:
    write_cloud(cloud(crs=crs), tmp_path / "tree.laz")
    assert read_cloud(tmp_path / "tree.laz").crs == crs


def test_metadata_larger_than_a_record(tmp_path: Path) -> None:
    metadata = {"long": tuple(range(50_000)), "crs_assumed": False}
    write_cloud(cloud(metadata=metadata), tmp_path / "tree.laz")
    assert read_cloud(tmp_path / "tree.laz").metadata["long"] == metadata["long"]


def test_notes_of_a_file_changed_since_are_not_believed(tmp_path: Path) -> None:
    file = tmp_path / "tree.laz"
    write_cloud(cloud(metadata={"flags": ("sparse",)}), file)
    las = laspy.read(file)
    las.points = las.points[:100]
    las.write(file)
    assert "flags" not in read_cloud(file).metadata


def test_a_wide_cloud_is_written_coarser(tmp_path: Path) -> None:
    wide = np.array([[0, 0, 0], [50_000.1234, 1, 2]])
    write_cloud(cloud(xyz=wide, attributes={}), tmp_path / "tree.laz")
    np.testing.assert_allclose(read_cloud(tmp_path / "tree.laz").xyz, wide, rtol=0, atol=1e-4)


def test_no_points_can_be_written(tmp_path: Path) -> None:
    write_cloud(cloud(xyz=np.empty((0, 3)), attributes={}), tmp_path / "tree.laz")
    assert len(laspy.read(tmp_path / "tree.laz")) == 0


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"xyz": np.full((1, 3), np.nan), "attributes": {}}, "not finite; clean it"),
        ({"crs": "EPSG:1"}, "CRS 'EPSG:1' is not known; give it as EPSG:N"),
        (
            {"attributes": {"intensity": np.full(1000, 0.5)}},
            "'intensity' must be whole numbers from 0 to 65535",
        ),
        ({"attributes": {"withheld": np.full(1000, 2)}}, "'withheld' must be whole numbers from 0 to 1"),
        ({"attributes": {"name": np.full(1000, "oak")}}, "'name' .* does not fit a LAS file; leave it out"),
        ({"attributes": {"n" * 33: np.zeros(1000)}}, "a name of at most 32 letters"),
        ({"attributes": {"matrix": np.zeros((1000, 9))}}, "one to three numbers a point"),
        ({"attributes": {"X": np.zeros(1000)}}, "'X' .* leave it out"),
    ],
)
def test_what_does_not_fit_leaves_no_file(tmp_path: Path, changes: dict[str, object], says: str) -> None:
    with pytest.raises(OutputError, match=says):
        write_cloud(cloud(**changes), tmp_path / "tree.laz")
    assert not list(tmp_path.iterdir())


def test_other_suffixes_are_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"ends in \.laz or \.las"):
        write_cloud(cloud(), tmp_path / "tree.ply")


def test_every_value_becomes_json() -> None:
    value = {"a": np.int64(1), "b": np.arange(2), "c": (1, [2.5, None]), "d": {2, 1}, 5: np.bool_(True)}
    assert plain(value) == {"a": 1, "b": [0, 1], "c": [1, [2.5, None]], "d": [1, 2], "5": True}
    assert plain(Path("a") / "b") == str(Path("a") / "b")


@given(st.recursive(st.integers() | st.text() | st.none(), lambda item: st.lists(item).map(tuple)))
def test_tuples_survive(value: object) -> None:
    assert frozen(plain(value)) == value


def test_a_disk_that_takes_no_more_is_a_sentence_and_leaves_no_file(tmp_path: Path, monkeypatch) -> None:
    def full(*_arguments: object, **_options: object) -> None:
        msg = "IoError: failed to write whole buffer"  # all that the compressor tells
        raise LazrsError(msg)

    monkeypatch.setattr(laspy.LasData, "write", full)
    with pytest.raises(OutputError, match=r"a\.laz: cannot be written .*disk may be full.*; free space"):
        write_cloud(cloud(), tmp_path / "a.laz")
    assert list(tmp_path.iterdir()) == []
