"""What merging looks at grows with the cells and the trees, not with their square."""

from __future__ import annotations

import json
from itertools import chain
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.airborne.grid import Cell
from pipeline.batch.columns import completed
from pipeline.batch.merging import finished, statistics
from pipeline.batch.merging.areas import of_cells
from pipeline.batch.merging.finished import FinishedCell, finished_cells, overlaps, trees_in_order
from pipeline.batch.merging.statistics import Statistics
from pipeline.errors import InputFormatError
from pipeline.formats import geoparquet
from tests.batch.merging.fakes import cell_table, town


class Counted(Cell):
    """A cell that tells how often it was asked for its core."""

    asked = 0

    @property
    def core(self):
        """Return the core, and count."""
        Counted.asked += 1
        return super().core


def of(*cells: Cell) -> list[FinishedCell]:
    return [FinishedCell(cell, Path(cell.name), {}) for cell in sorted(cells)]


def meet(one: Cell, other: Cell) -> bool:
    (w, s, e, n), (west, south, east, north) = one.core, other.core
    return w < east and west < e and s < north and south < n


def test_a_cell_is_compared_with_its_neighbours_only():
    cells = of(*(Counted(500.0 * x, 500.0 * y, 500.0) for x in range(100) for y in range(200)))
    Counted.asked = 0
    assert list(overlaps(iter(cells))) == []
    assert Counted.asked < 10 * len(cells), "each against its column would be 200 a cell"


@given(
    st.sets(
        st.builds(
            Cell,
            st.integers(0, 12).map(float),
            st.integers(0, 12).map(float),
            st.sampled_from([1.0, 2.0, 4.0]),
        ),
        max_size=14,
    )
)
def test_cells_that_lie_over_each_other_are_found(cells):
    ordered = of(*cells)
    found = list(overlaps(ordered))
    assert all(meet(one.cell, other.cell) and one.cell < other.cell for one, other in found)
    pairs = [(a, b) for k, a in enumerate(ordered) for b in ordered[k + 1 :] if meet(a.cell, b.cell)]
    assert bool(found) == bool(pairs)


def test_a_cell_beside_its_own_quarter_is_refused(tmp_path):
    for name in ("121500_487000_500", "121750_487250_250", "122000_487000_500"):
        folder = tmp_path / "cells" / name
        folder.mkdir(parents=True)
        (folder / "manifest.json").write_text(json.dumps({"cell": name}))
    with pytest.raises(InputFormatError, match=r"121750_487250_250: lies over .*121500_487000_500, .*remove"):
        finished_cells(tmp_path)


def test_every_tree_is_looked_at_a_few_times(tmp_path, monkeypatch):
    monkeypatch.setattr(geoparquet, "ROW_GROUP", 50)
    tables = town(tmp_path, columns=3, rows=30, count=12)
    looked = []
    parted = finished._before
    monkeypatch.setattr(
        finished, "_before", lambda trees, name: looked.append(len(trees)) or parted(trees, name)
    )
    names = [
        name for part in trees_in_order(finished_cells(tmp_path)) for name in part["tree_id"].to_pylist()
    ]
    assert names == sorted(names)
    assert len(names) == sum(map(len, tables.values()))
    assert sum(looked) < 5 * len(names), "with every cell it would be ten times as many"


def test_as_many_areas_as_a_country_has_cells(monkeypatch):
    side = 200
    cells = [Cell(500.0 * x, 500.0 * y, 500.0) for x in range(side) for y in range(side)]
    monkeypatch.setattr(statistics, "_spread", lambda _: [None] * len(statistics.SPREAD))
    table = completed(cell_table(Cell(0.0, 0.0, side * 500.0), 40_000), {})
    told = Statistics(of_cells(cells))
    for start in range(0, len(table), 10_000):
        told.add(table.slice(start, 10_000))
    rows = list(told.rows())  # each area against all others would be 10^9 steps
    assert rows[0]["trees"] == len(table)
    assert sum(row["trees"] for row in rows[2:] if row["species"] == "all") == len(table)
    assert sum(row["species"] == "all" for row in rows) == len(cells) + 1


def test_a_tree_is_held_once_however_many_areas_it_lies_in():
    cell = Cell(0.0, 0.0, 500.0)
    table = completed(cell_table(cell, 400), {})
    held = []
    for cells in ([cell], [cell] * 5):
        told = Statistics(of_cells(cells))
        told.add(table)
        arrays = chain(told._kinds, *told._pairs)
        held.append(sum(np.asarray(one).nbytes for one in arrays) / len(table))
    assert held == [4 + 8, 4 + 5 * 8]
