"""The small accuracy suite: its figures within tolerances, and going on where it was."""

from __future__ import annotations

import json
import shutil

import pytest

pytest.importorskip(
    "open3d", reason="scans are made by open3d: pip install 'treepipe[scan]'", exc_type=ImportError
)


@pytest.fixture(scope="module")
def suite(tmp_path_factory):
    return tmp_path_factory.mktemp("suite")


def test_the_small_suite(call, suite):
    result = call("synth", "suite", "-o", suite, "--small")
    assert result.exit_code == 0, result.stderr
    assert result.stdout == (suite / "suite.md").read_text()
    near, far = json.loads((suite / "suite.json").read_text())
    assert near["recall"] >= 0.95
    assert near["precision"] >= 0.95
    assert near["order_accuracy"] >= 0.8
    assert abs(near["dbh_error_pct"]) <= 4
    assert abs(near["volume_error_pct"]) <= 6
    assert abs(near["length_error_pct"]) <= 6
    assert near["above_floor_mm"] <= 1.5
    assert near["dbh_source"] == "measured"
    assert far["recall"] >= 0.1  # a sapling from 600 m
    assert far["dbh_source"] != "measured"
    assert (suite / "suite.svg").read_text().count("<circle") == 4
    assert (suite / "scans" / "tubes_sapling_1_tls.truth.npz").is_file()


def test_it_goes_on_where_it_was(call, suite):
    before = (suite / "suite.json").read_text()
    shutil.rmtree(suite / "scans")
    (suite / "cases" / "tubes_sapling_1_als.json").unlink()
    result = call("synth", "suite", "-o", suite, "--small")
    assert result.exit_code == 0, result.stderr
    assert {path.name.partition(".")[0] for path in (suite / "scans").iterdir()} == {"tubes_sapling_1_als"}
    without_time = [
        [{key: value for key, value in case.items() if key != "seconds"} for case in json.loads(text)]
        for text in (before, (suite / "suite.json").read_text())
    ]
    assert without_time[0] == without_time[1]
