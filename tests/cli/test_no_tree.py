"""Points that make no tree, given to a stage alone: one sentence, as from `run`."""

from __future__ import annotations

import numpy as np
import pytest

SHAPES = {
    "one place": np.tile([1.0, 2.0, 3.0], (500, 1)),
    "3 points": np.array([[1.0, 2.0, 3.0], [2.0, 3.0, 4.0], [4.0, 1.0, 2.0]]),
    "one line": np.repeat(np.arange(50.0)[:, None], 3, axis=1),
}


@pytest.mark.parametrize("command", ["clean", "skeleton"])
@pytest.mark.parametrize("shape", sorted(SHAPES))
def test_a_stage_refuses_what_is_no_tree(call, tmp_path, command, shape):
    cloud, result = tmp_path / "odd.xyz", tmp_path / {"clean": "out.laz", "skeleton": "out.ply"}[command]
    np.savetxt(cloud, SHAPES[shape])
    told = call(command, cloud, "-o", result)
    assert told.exit_code == 1
    assert told.stderr.startswith(f"treepipe: {cloud}: ")
    assert shape in told.stderr
    assert told.stderr.count("\n") == 1
    assert not result.exists()


def test_an_address_that_is_none_and_a_list_that_is_not_there_are_told_before_any_work(call, tmp_path):
    pytest.importorskip("dask", reason='finds trees in tiles; pip install "treepipe[batch]"')
    tile, out = tmp_path / "tile.laz", tmp_path / "town"
    tile.write_bytes(b"never read")
    told = call("batch", tile, "--out", out, "--scheduler", "foo")
    assert (told.exit_code, "tcp://HOST:PORT" in told.stderr) == (2, True)
    told = call("batch", tile, "--out", out, "--stems", tmp_path / "nope.gpkg")
    assert (told.exit_code, "nope.gpkg: there is no such file" in told.stderr) == (1, True)
    assert not out.exists()


def test_growth_that_is_stopped_in_its_first_year_leaves_no_log_behind(call, tmp_path):
    events, out = tmp_path / "events.toml", tmp_path / "years"
    events.write_text("[[event]]\nyear = 2\noperation = 'crown-raise'\nheight_m = 1.0\n")
    told = call("simulate", "--years", "1", "--events", events, "-o", out, "--no-picture")
    assert "year" in told.stderr
    assert told.exit_code
    assert not (out / "years.json").exists()
