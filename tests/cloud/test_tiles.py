"""Headers and points of tiles: every point format, and what is wrong with a file."""

from __future__ import annotations

import laspy
import numpy as np
import pytest

from pipeline.cloud import tiles
from pipeline.cloud.parts import (
    SNAP_M,
    Frame,
    Lattice,
    append,
    carry_over,
    common_lattice,
    finish_part,
    open_part,
    read_part,
    start_part,
    steps,
)
from pipeline.cloud.tiles import chunks, query, read_tile
from pipeline.errors import InputFormatError, InputMissingError
from tests.batch.stubs import make_copc, make_tile

MILLIMETRES = Lattice((0.001, 0.001, 0.001), (0.0, 0.0, 0.0))


def all_of(tile):
    return np.concatenate(list(chunks(tile)))


@pytest.mark.parametrize("number", range(11))
@pytest.mark.parametrize("suffix", [".las", ".laz"])
def test_points_of_every_format_arrive_untouched(number, suffix, tmp_path, monkeypatch):
    if suffix == ".laz" and number in {4, 5, 9, 10}:
        pytest.skip("LAZ does not compress wave packets here")
    monkeypatch.setattr(tiles, "POINTS_AT_ONCE", 700)
    path = make_tile(tmp_path / f"tile{suffix}", points=2000, point_format=number)
    told, records = laspy.read(path), all_of(read_tile(path))
    for name in ("X", "Y", "Z", "intensity", "point_source_id"):
        assert (records[name] == told[name]).all()
    assert (records["classification"] == told.classification).all()
    assert (
        records["bit_fields"] == np.array(told.return_number) + 16 * np.array(told.number_of_returns)
    ).all()
    if "gps_time" in told.point_format.dimension_names:
        assert (records["gps_time"] == told.gps_time).all()
    assert (np.concatenate(list(chunks(read_tile(path), 1500, 300))) == records[1500:1800]).all()


def test_a_header_says_what_there_is(tmp_path):
    tile = read_tile(make_tile(tmp_path / "a.laz", crs="EPSG:7415", points=50))
    assert (tile.crs, tile.units, tile.points, tile.copc) == ("EPSG:7415", (), 50, False)
    feet = read_tile(make_tile(tmp_path / "b.laz", crs="EPSG:2249"))
    assert feet.units == ("US survey foot",)
    assert read_tile(make_tile(tmp_path / "c.laz")).crs is None
    assert tile.fingerprint != feet.fingerprint


def test_a_part_is_a_las_file_that_others_can_read(tmp_path):
    tile = read_tile(make_tile(tmp_path / "a.laz", crs="EPSG:28992"))
    records, path = all_of(tile), tmp_path / "part.las"
    start_part(path, Frame(tile.lattice, "", standard_time=True))
    append(path, records[:1000])
    append(path, records[1000:])
    finish_part(path)
    told = laspy.read(path)
    assert (np.array(told.points.array) == records).all()
    assert np.allclose(told.header.mins, told.xyz.min(axis=0))
    assert np.allclose(told.header.maxs, told.xyz.max(axis=0))
    assert told.header.number_of_points_by_return[0] == len(records)
    cloud = read_part(path, crs="EPSG:28992")
    assert cloud.metadata["gps_time_standard"] is True
    assert (cloud.origin % 1 == 0).all()
    assert (cloud.xyz % SNAP_M == 0).all()
    assert np.abs(cloud.xyz + cloud.origin - told.xyz).max() <= SNAP_M / 2 + 1e-9
    path.write_bytes(path.read_bytes()[:-30])
    with pytest.raises(InputFormatError, match="run the batch again"):
        open_part(path)


def test_copc_is_asked_for_a_window(tmp_path):
    plain = make_tile(tmp_path / "plain.laz", crs="EPSG:28992")
    tile = read_tile(make_copc(tmp_path / "tile.copc.laz", plain))
    assert tile.copc
    window = (121_010.0, 487_020.0, 121_030.0, 487_060.0)
    records, everything = query(tile, window), all_of(read_tile(plain))
    x, y = MILLIMETRES.along(0, everything), MILLIMETRES.along(1, everything)
    inside = (x >= window[0]) & (x <= window[2]) & (y >= window[1]) & (y <= window[3])
    assert set(everything["gps_time"][inside]) <= set(records["gps_time"])
    assert len(records) < inside.sum() + 5
    assert len(query(tile, (0.0, 0.0, 10.0, 10.0))) == 0


def test_what_is_wrong_with_a_tile_is_said(tmp_path):
    good = make_tile(tmp_path / "good.laz", points=60_000).read_bytes()
    plain = make_tile(tmp_path / "plain.las").read_bytes()
    bad = {
        "cut.laz": (good[: len(good) // 2], "cut"),
        "short.las": (plain[:-100], "short"),
        "text.las": (b"hello", "LAS"),
        "nothing.laz": (b"", "LAS"),
        "none.laz": (make_tile(tmp_path / "n.laz", points=0).read_bytes(), "holds no points"),
    }
    for name, (content, _) in bad.items():
        (tmp_path / name).write_bytes(content)
        with pytest.raises(InputFormatError, match=name):
            read_tile(tmp_path / name)
    with pytest.raises(InputMissingError, match="no such file"):
        read_tile(tmp_path / "absent.laz")


def test_a_tile_that_breaks_in_the_middle_is_named(tmp_path):
    path = make_tile(tmp_path / "broken.laz", points=120_000)
    content = bytearray(path.read_bytes())
    middle = len(content) // 2
    content[middle : middle + 2000] = bytes(2000)
    path.write_bytes(content)
    tile = read_tile(path)
    try:
        found = len(all_of(tile))
    except InputFormatError as error:
        assert "broken.laz" in str(error)  # noqa: PT017 (a decoder may also notice nothing)
    else:
        assert found == 120_000


@pytest.mark.parametrize("other", [Lattice((0.01,) * 3, (100.0, 200.0, 0.0)), MILLIMETRES])
def test_integers_are_carried_over_exactly(other, tmp_path):
    records = all_of(read_tile(make_tile(tmp_path / "a.laz", scale=other.scales[0], offset=other.offsets)))
    common = common_lattice([other, MILLIMETRES], (0.0, 0.0, 0.0), (2e5, 5e5, 30.0))
    assert common.scales == MILLIMETRES.scales
    before = other.world(records)
    carry_over(records, other, common)
    assert (common.world(records) == before).all()


def test_lattices_that_do_not_fit_meet_in_the_snap(tmp_path):
    odd = Lattice((0.0003, 0.0003, 0.0003), (121_000.00007, 487_000.0, 0.0))
    assert steps(odd, MILLIMETRES) is None
    common = common_lattice([odd, MILLIMETRES], (1e5, 4e5, 0.0), (2e5, 5e5, 30.0))
    assert common.scales == (SNAP_M,) * 3
    records = all_of(read_tile(make_tile(tmp_path / "a.laz", scale=0.0003, offset=odd.offsets)))
    before = odd.world(records)
    carry_over(records, odd, common)
    assert (common.world(records) == before).all()
