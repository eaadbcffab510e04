"""Every point in every cell that needs it, once; however tiles and slices are cut."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.airborne.grid import GridOptions, cells_over, inside
from pipeline.batch import explode as module
from pipeline.batch.explode import Router, explode, exploded, part_path, slices_of
from pipeline.batch.gather import Sources, gather
from pipeline.cloud import tiles
from pipeline.cloud.parts import open_part
from pipeline.cloud.tiles import chunks
from tests.batch.stubs import make_copc, make_tile, plan_of


def cells_of(plan, work, *, quarter=None):
    """Return for each cell of a plan its world coordinates and times, in a canonical order."""
    for tile in plan.tiles:
        for piece in slices_of(tile):
            explode(piece, plan.cells, plan.grid, plan.frame, work)
    found = {}
    for cell in plan.cells:
        fed = [plan.tiles[number] for number in plan.feeders[cell]]
        parts = tuple(
            tuple(path for piece in slices_of(tile) if (path := part_path(work, cell, piece)).exists())
            for tile in fed
        )
        part = quarter(cell) if quarter else cell
        sources = Sources(tuple(fed), parts, plan.frame, whole=part == cell)
        gathered = gather(sources, part, plan.grid.buffer_m, work / "gathered" / f"{part.name}.las")
        found[part.name] = canonical(open_part(gathered.path).records(), plan.frame.lattice)
        assert gathered.points == len(found[part.name])
    return found


def canonical(records, lattice):
    table = np.column_stack([lattice.world(records), records["gps_time"]])
    return table[np.lexsort(table.T)]


def points_of(plan):
    return np.concatenate([
        np.column_stack([tile.lattice.world(records), records["gps_time"]])
        for tile in plan.tiles
        for records in chunks(tile)
    ])  # fmt: skip


@pytest.mark.parametrize("buffer_m", [0.0, 5.0, 70.0])
def test_a_cell_gets_just_the_points_of_its_window(buffer_m, tmp_path, monkeypatch):
    monkeypatch.setattr(module, "SLICE_POINTS", 900)
    monkeypatch.setattr(tiles, "POINTS_AT_ONCE", 333)
    first = make_tile(tmp_path / "a.laz", size_m=120.0)
    plan = plan_of(first, grid=GridOptions(core_m=50, buffer_m=buffer_m))
    assert len(slices_of(plan.tiles[0])) == 5
    everything = points_of(plan)
    for name, table in cells_of(plan, tmp_path / "work").items():
        cell = next(cell for cell in plan.cells if cell.name == name)
        wanted = everything[inside(cell.window(buffer_m), everything[:, :2])]
        assert (table == wanted[np.lexsort(wanted.T)]).all()


@given(st.lists(st.tuples(st.integers(-20, 1020), st.integers(-20, 1020)), max_size=12), st.integers(0, 80))
def test_every_point_is_routed_to_all_its_cells(places, buffer):
    grid = GridOptions(core_m=50, buffer_m=buffer / 10)
    cells = cells_over((0.0, 0.0, 99.0, 99.0), grid)[1:]
    xy = np.array(places, dtype=float).reshape(-1, 2) / 10
    found = {cell.name: set() for cell in cells}
    for number, chosen in Router(cells, grid).route(*xy.T):
        found[cells[number].name] |= set(chosen.tolist())
    for cell in cells:
        assert found[cell.name] == set(np.flatnonzero(inside(cell.window(grid.buffer_m), xy)).tolist())


def test_overlapping_tiles_of_other_lattices_give_every_point_once(tmp_path, monkeypatch):
    monkeypatch.setattr(tiles, "POINTS_AT_ONCE", 1000)
    import laspy

    whole = laspy.read(make_tile(tmp_path / "whole.laz", scale=0.01))
    x = np.array(whole.x)
    for name, keep in {"west.laz": x < 121_060, "east.las": x > 121_040}.items():
        part = laspy.LasData(whole.header)
        part.points = whole.points[keep]
        if name == "east.las":
            part.change_scaling([0.001] * 3, [121_000.0, 487_000.0, 0.0])
        part.write(tmp_path / name)
    one = cells_of(plan_of(tmp_path / "whole.laz"), tmp_path / "one")
    two = cells_of(plan_of(tmp_path / "west.laz", tmp_path / "east.las"), tmp_path / "two")
    assert one.keys() == two.keys()
    assert sum(map(len, two.values())) > 4000
    assert all((one[name] == two[name]).all() for name in one)


def test_copc_gives_the_same_points(tmp_path):
    plain = make_tile(tmp_path / "plain.laz")
    copc = make_copc(tmp_path / "tile.copc.laz", plain)
    one, two = cells_of(plan_of(plain), tmp_path / "one"), cells_of(plan_of(copc), tmp_path / "two")
    assert one.keys() == two.keys()
    assert all((one[name] == two[name]).all() for name in one)


def test_a_quarter_is_cut_out_of_its_cell(tmp_path):
    from pipeline.airborne.grid import split

    grid = GridOptions(core_m=200, buffer_m=5)
    plan = plan_of(make_tile(tmp_path / "a.laz"), grid=grid)
    (table,) = cells_of(plan, tmp_path / "work", quarter=lambda cell: split(cell)[0]).values()
    window = split(plan.cells[0])[0].window(5.0)
    everything = points_of(plan)
    assert len(table) == inside(window, everything[:, :2]).sum()


def test_what_is_exploded_is_not_done_again(tmp_path):
    plan = plan_of(make_tile(tmp_path / "a.laz"))
    (piece,) = slices_of(plan.tiles[0])
    work = tmp_path / "work"
    assert exploded(piece, plan.cells, work) is None
    told = explode(piece, plan.cells, plan.grid, plan.frame, work)
    assert exploded(piece, plan.cells, work) == told
    assert told["strays"] == 0
    part_path(work, plan.cells[1], piece).unlink()
    assert exploded(piece, plan.cells[:1], work) == told
    assert exploded(piece, plan.cells, work) is None
    assert not list(work.rglob(".tmp-*"))


def test_points_outside_the_extent_in_the_header_are_counted(tmp_path):
    import struct

    path = make_tile(tmp_path / "a.las")
    content = bytearray(path.read_bytes())
    struct.pack_into("<d", content, 179, 121_050.0)  # the greatest x
    path.write_bytes(content)
    plan = plan_of(path)
    told = explode(slices_of(plan.tiles[0])[0], plan.cells, plan.grid, plan.frame, tmp_path / "work")
    assert 1500 < told["strays"] < 2500
