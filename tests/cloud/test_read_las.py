"""LAS and LAZ: every point format, reference systems, extra dimensions, and files that break off."""

from __future__ import annotations

from pathlib import Path

import laspy
import numpy as np
import pytest
from pyproj import CRS

from pipeline.cloud import read_cloud
from pipeline.errors import InputFormatError

COUNT = 500


def made(
    file: Path, point_format: int = 6, *, crs: str | None = None, extra: bool = False, count: int = COUNT
) -> laspy.LasData:
    """Write a cloud at AHN coordinates to the millimetre and return what was written."""
    rng = np.random.default_rng(1)
    header = laspy.LasHeader(version="1.4" if point_format > 5 else "1.3", point_format=point_format)
    header.scales, header.offsets = [0.001] * 3, [0.0] * 3
    if crs:
        header.add_crs(CRS.from_user_input(crs))
    if extra:
        header.add_extra_dim(laspy.ExtraBytesParams("Amplitude", np.uint16, scales=[0.01], offsets=[0.0]))
        header.add_extra_dim(laspy.ExtraBytesParams("normal", "3f4"))
    las = laspy.LasData(header)
    las.X = rng.integers(120_000_000, 120_010_000, count)
    las.Y = rng.integers(487_000_000, 487_010_000, count)
    las.Z = rng.integers(-1500, 15_000, count)
    las.classification = rng.integers(0, 20, count)
    las.intensity = rng.integers(0, 60_000, count)
    las.return_number = rng.integers(1, 6, count)
    las.number_of_returns = rng.integers(1, 6, count)
    las.withheld = rng.integers(0, 2, count)
    if extra:
        las.Amplitude, las.normal = rng.integers(0, 999, count) / 100, rng.random((count, 3))
    las.write(file)
    return las


@pytest.mark.parametrize("suffix", [".las", ".laz", ".copc.laz"])
@pytest.mark.parametrize("point_format", [0, 1, 2, 3, 6, 7, 8])
def test_every_point_format(tmp_path: Path, point_format: int, suffix: str) -> None:
    las = made(tmp_path / f"tree{suffix}", point_format)
    cloud = read_cloud(tmp_path / f"tree{suffix}")
    stored = np.column_stack([las.X, las.Y, las.Z]).astype(np.int64)
    np.testing.assert_array_equal(np.rint(cloud.world * 1000).astype(np.int64), stored)
    np.testing.assert_allclose(cloud.xyz, (stored - cloud.origin * 1000) / 1000, rtol=0, atol=1e-9)
    assert cloud.origin.tolist() == [120000, 487000, -2]
    assert cloud.crs is None
    for name in ("classification", "intensity", "return_number", "number_of_returns", "withheld"):
        np.testing.assert_array_equal(cloud.attributes[name], np.array(las[name]))
    assert cloud.attributes["withheld"].dtype == bool


@pytest.mark.parametrize("point_format", [1, 3, 6, 8])
@pytest.mark.parametrize(
    ("crs", "code"),
    [("EPSG:28992", "EPSG:28992"), ("EPSG:7415", "EPSG:7415"), ("EPSG:32631+5773", "EPSG:32631")],
)
def test_the_reference_system(tmp_path: Path, point_format: int, crs: str, code: str) -> None:
    if point_format < 6 and crs != "EPSG:28992":
        pytest.skip("laspy writes no compound system as GeoTIFF keys")
    made(tmp_path / "tree.laz", point_format, crs=crs)
    assert read_cloud(tmp_path / "tree.laz").crs == code


@pytest.mark.parametrize("point_format", [0, 3, 6])
def test_extra_dimensions_are_attributes(tmp_path: Path, point_format: int) -> None:
    las = made(tmp_path / "tree.laz", point_format, extra=True)
    cloud = read_cloud(tmp_path / "tree.laz")
    np.testing.assert_allclose(cloud.attributes["Amplitude"], np.array(las.Amplitude))
    np.testing.assert_array_equal(cloud.attributes["normal"], np.array(las.normal))
    assert cloud.attributes["normal"].dtype == np.float32


@pytest.mark.parametrize("suffix", [".las", ".laz"])
def test_a_file_that_breaks_off(tmp_path: Path, suffix: str) -> None:
    file = tmp_path / f"tree{suffix}"
    made(file)
    whole = file.read_bytes()
    for share in (0.01, 0.05, 0.3, 0.7, 0.95):
        file.write_bytes(whole[: int(len(whole) * share)])
        with pytest.raises(InputFormatError, match=rf"tree{suffix}: cannot be read .* export it again"):
            read_cloud(file)


def test_records_cut_between_two_points(tmp_path: Path) -> None:
    file = tmp_path / "tree.las"
    las = made(file)
    file.write_bytes(file.read_bytes()[: -10 * las.header.point_format.size])
    with pytest.raises(InputFormatError, match="490 of 500 points found"):
        read_cloud(file)


@pytest.mark.parametrize("suffix", [".las", ".laz"])
def test_a_changed_header_raises_our_error_or_none(tmp_path: Path, suffix: str) -> None:
    file = tmp_path / f"tree{suffix}"
    made(file, extra=True)
    whole, rng = file.read_bytes(), np.random.default_rng(3)
    refused = 0
    for _ in range(40):
        changed = bytearray(whole)
        for where in rng.integers(0, 375, 3):
            changed[where] = rng.integers(256)
        file.write_bytes(changed)
        try:
            read_cloud(file)
        except InputFormatError:
            refused += 1
    assert refused


@pytest.mark.parametrize("suffix", [".las", ".laz"])
def test_no_points(tmp_path: Path, suffix: str) -> None:
    made(tmp_path / f"tree{suffix}", count=0)
    with pytest.raises(InputFormatError, match="holds no points; export it again"):
        read_cloud(tmp_path / f"tree{suffix}")
