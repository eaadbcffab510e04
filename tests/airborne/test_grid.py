"""Cells of the national grid: they tile the plane, whatever their size."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from pipeline.airborne.grid import Cell, GridOptions, can_split, cells_over, split
from pipeline.errors import UsageError

metres = st.integers(-400_000, 700_000 * 4).map(lambda quarter: quarter / 4)


@given(metres, metres, st.sampled_from([10.0, 62.5, 500.0]))
def test_every_point_is_in_one_core(x, y, core):
    cells = cells_over((x - core, y - core, x + core, y + core), GridOptions(core_m=core))
    assert sum(bool(cell.contains([x, y])) for cell in cells) == 1
    assert len(cells) == 9
    assert list(cells) == sorted(cells)


@given(metres, metres)
def test_quarters_share_out_a_core(x, y):
    (cell,) = cells_over((x, y, x, y), GridOptions())
    rng = np.random.default_rng(1)
    xy = np.array([cell.x0, cell.y0]) + np.round(rng.random((200, 2)) * 500, 1)
    shares = [quarter.contains(xy) for quarter in split(cell)]
    assert (np.sum(shares, axis=0) == cell.contains(xy)).all()
    assert all(cell.covers(quarter) for quarter in split(cell))


@given(metres, metres, st.sampled_from([500.0, 62.5, 0.5]))
def test_a_name_gives_the_cell_back(x, y, size):
    assert Cell.named(Cell(x, y, size).name) == Cell(x, y, size)


def test_the_east_and_north_edge_is_the_neighbours():
    cell = Cell(0.0, 0.0, 500.0)
    assert cell.contains([[0.0, 0.0], [499.999, 0.0], [500.0, 0.0], [0.0, 500.0]]).tolist() == [1, 1, 0, 0]
    assert cell.window(20.0) == (-20.0, -20.0, 520.0, 520.0)


def test_cells_are_halved_while_they_stay_on_the_raster():
    sizes = [500.0]
    while can_split(Cell(0.0, 0.0, sizes[-1])):
        sizes.append(split(Cell(0.0, 0.0, sizes[-1]))[0].size_m)
    assert sizes == [500.0, 250.0, 125.0, 62.5]


@pytest.mark.parametrize("name", ["", "a_b_c", "1_2", "1_2_0", "1_2_-5", "1_2_3_4"])
def test_what_is_no_name_of_a_cell_is_refused(name):
    with pytest.raises(UsageError, match="X0_Y0_SIZE"):
        Cell.named(name)


def test_a_core_off_the_raster_is_refused():
    with pytest.raises(ValidationError, match=r"multiple of 0\.5"):
        GridOptions(core_m=499.9)
