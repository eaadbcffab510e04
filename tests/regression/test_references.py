"""The samples against their references, as the nightly guard checks them."""

from __future__ import annotations

from pathlib import Path

from pipeline.regression import guard
from pipeline.regression.page import sentence

ROOT = Path(__file__).parents[2]


def test_the_samples_have_not_drifted(tmp_path):
    night = guard(ROOT / "tests/references", tmp_path, clouds=ROOT / "data/samples")
    assert [sentence(tree) for tree in night.trees if tree.status != "ok"] == []
    assert sorted(tree.name for tree in night.trees) == ["lime", "maple", "oak"]
