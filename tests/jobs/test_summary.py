"""summary.json."""

from __future__ import annotations

import json

import pipeline
from pipeline.jobs.summary import Outcome, write_summary


def test_summary_has_the_keys_and_the_order_of_the_inputs(tmp_path):
    outcomes = [Outcome("b", "in/b.laz", 1.25), Outcome("a", "in/a.laz", 0.5, error="in/a.laz: is empty")]
    write_summary(outcomes, 2.0, tmp_path / "summary.json")
    assert json.loads((tmp_path / "summary.json").read_text()) == {
        "inputs": [
            {"name": "b", "path": "in/b.laz", "status": "ok", "error": None, "seconds": 1.25},
            {
                "name": "a",
                "path": "in/a.laz",
                "status": "failed",
                "error": "in/a.laz: is empty",
                "seconds": 0.5,
            },
        ],
        "ok": 1,
        "failed": 1,
        "seconds": 2.0,
        "version": pipeline.__version__,
    }
