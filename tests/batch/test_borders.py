"""A tile in small cells and the same tile in one: the same trees, rows, models and features."""

from __future__ import annotations

import json
from pathlib import Path

import pyarrow.parquet as pq

from pipeline.airborne.grid import GridOptions
from pipeline.batch.cell import CITY, MODELS, TABLE, CellTask, work_cell
from pipeline.batch.explode import explode, part_path, slices_of
from pipeline.batch.gather import Sources, gather
from pipeline.config import read_config
from pipeline.lsystem import Archive
from tests.batch.stubs import plan_of

WIDE_M = 60.0  # of a corner of the plot with some fifty trees
OF_THE_CELL = ("cell_id", "model_uri")


def trees_of(tile: Path, out: Path, core_m: float):
    """Return row, model and drawn feature of every tree, by its name."""
    plan = plan_of(tile, grid=GridOptions(core_m=core_m, buffer_m=20))
    config, found = read_config(preset="airborne"), {}
    for piece in slices_of(plan.tiles[0]):
        explode(piece, plan.cells, plan.grid, plan.frame, out)
    for cell in plan.cells:
        paths = (part_path(out, cell, piece) for piece in slices_of(plan.tiles[0]))
        parts = (tuple(path for path in paths if path.exists()),)
        sources = Sources((plan.tiles[0],), parts, plan.frame, whole=True)
        points = gather(sources, cell, plan.grid.buffer_m, out / f"{cell.name}.las").path
        folder = out / cell.name
        work_cell(CellTask(cell, points, folder, config_json=config.model_dump_json(), crs="EPSG:2056"))
        drawn = features(folder / CITY)
        models = Archive(folder / MODELS)
        for row in pq.read_table(folder / TABLE).to_pylist():
            name = row["tree_id"]
            assert name not in found, f"{name} is in two cells"
            told = {key: value for key, value in row.items() if key not in OF_THE_CELL}
            found[name] = told, models.read(name), drawn[name]
    return found


def test_cells_give_the_trees_of_the_whole(shared_data: Path, tmp_path: Path) -> None:
    tile = corner(shared_data / "tiles" / "chablais3.laz", tmp_path / "corner.laz")
    whole, cells = trees_of(tile, tmp_path / "one", 500.0), trees_of(tile, tmp_path / "many", 25.0)
    assert whole.keys() == cells.keys()
    assert len(whole) > 30
    for name, (row, model, drawn) in whole.items():
        assert cells[name][0] == row
        assert cells[name][1] == model
        assert cells[name][2] == drawn


def features(path: Path) -> dict[str, str]:
    """Return the line of every tree, by its name, and the transform that they share."""
    first, *lines = path.read_text(encoding="utf-8").splitlines()
    shared = json.dumps(json.loads(first)["transform"])
    return {json.loads(line)["id"]: shared + line for line in lines}


def corner(tile: Path, path: Path) -> Path:
    """Cut a square out of a tile."""
    import laspy

    las = laspy.read(tile)
    inside = (las.x < las.x.min() + WIDE_M) & (las.y < las.y.min() + WIDE_M)
    las.points = las.points[inside]
    las.write(path)
    return path
