"""One tree from points to files, whole and step by step."""

from __future__ import annotations

import json

import numpy as np
import pytest

import pipeline
from pipeline.cloud import write_cloud
from pipeline.config import Config
from pipeline.exchange import DEFAULT_FORMATS, FORMATS, read_model
from pipeline.formats import model_npz, qsm, skeleton_ply
from pipeline.model import PointCloud
from pipeline.run import Outputs, reconstruct, write_outputs
from pipeline.store import Store
from pipeline.view import graphics

COARSE = Config().with_settings(["clean.voxel_m=0.02", "skeleton.fine_m=0.03", "cylinders.rounds=1"])
"""Coarse enough to be quick; what is tested here does not depend on it."""


@pytest.fixture(scope="module")
def cloud(samples):
    return pipeline.read_cloud(samples / "maple.laz")


@pytest.fixture(scope="module")
def store():
    return Store()


@pytest.fixture(scope="module")
def tree(cloud, store):
    return reconstruct(cloud, COARSE, store)


def test_store_holds_every_stage(tree, store):
    assert list(store.artefacts) == ["clean", "skeleton", "fit"]
    assert store.artefacts["fit"].value is tree
    assert min(store.seconds.values()) > 0


def test_another_fit_keeps_the_skeleton(cloud, tree, store):
    before = store.artefacts["skeleton"].value
    other = Store()
    other.artefacts.update(store.artefacts)
    changed = reconstruct(cloud, COARSE.with_settings(["cylinders.min_radius_m=0.02"]), other)
    assert changed is not tree
    assert changed.radius.min() >= 0.02
    assert other.artefacts["skeleton"].value is before


def test_row_order_does_not_matter(cloud, tree):
    shuffled = cloud.take(np.random.default_rng(0).permutation(len(cloud)))
    again = reconstruct(shuffled, COARSE)
    assert np.array_equal(again.radius, tree.radius)
    assert np.array_equal(again.skeleton.xyz, tree.skeleton.xyz)


def test_step_by_step_gives_the_same_model(cloud, tree, tmp_path):
    write_cloud(pipeline.clean(cloud, options=COARSE.clean), tmp_path / "cloud.laz")
    cleaned = pipeline.read_cloud(tmp_path / "cloud.laz")
    skeleton_ply.write(pipeline.extract(cleaned, options=COARSE.skeleton), tmp_path / "skeleton.ply")
    skeleton = skeleton_ply.read(tmp_path / "skeleton.ply")
    model = pipeline.fit(cleaned, skeleton, options=COARSE.cylinders)
    model_npz.write(model, tmp_path / "model.npz")
    back = read_model(tmp_path / "model.npz")
    assert np.array_equal(back.skeleton.parent, tree.skeleton.parent)
    assert np.array_equal(back.skeleton.xyz, tree.skeleton.xyz)
    assert np.array_equal(back.radius, tree.radius)
    assert back.trunk == tree.trunk


def test_outputs_and_report(cloud, tree, store, tmp_path):
    outputs = Outputs(tmp_path / "maple", "maple", picture=False)
    told = write_outputs(tree, cloud, outputs, config=COARSE, store=store)
    names = {path.name for path in (tmp_path / "maple").iterdir()}
    assert names == {"report.json", *(f"maple{FORMATS[each].suffix}" for each in DEFAULT_FORMATS)}
    written = json.loads((tmp_path / "maple" / "report.json").read_text())
    assert written == json.loads(told.to_json())
    assert written["lsystem"]["bytes"] == (tmp_path / "maple" / "maple.ls.json").stat().st_size
    assert 0 < written["lsystem"]["max_error_mm"] <= 0.6
    assert written["config_hash"] == COARSE.config_hash
    assert written["seconds"]["total"] >= written["seconds"]["fit"] > 0
    table = qsm.read(tmp_path / "maple" / "maple.qsm.csv")
    assert 1000 * table.volume.sum() == pytest.approx(written["volume_l"], rel=1e-3)


def test_without_lsystem_its_figures_are_null(cloud, tree, tmp_path):
    told = write_outputs(tree, cloud, Outputs(tmp_path, "oak", ("qsm",), picture=False))
    assert told.lsystem == {"bytes": None, "max_error_mm": None}


def test_a_machine_that_cannot_draw_warns_and_goes_on(cloud, tree, tmp_path, monkeypatch):
    monkeypatch.setattr(graphics, "has_egl", lambda: False)
    monkeypatch.setattr(graphics.sys, "platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    heard: list[str] = []
    write_outputs(tree, cloud, Outputs(tmp_path, "oak", ("qsm",)), warn=heard.append)
    assert len(heard) == 1
    assert "apt-get install libegl1 libgl1" in heard[0]
    assert (tmp_path / "report.json").is_file()


def test_the_truth_is_found(cloud):
    told = pipeline.report(pipeline.reconstruct(cloud))
    assert told.dbh_lo_cm <= told.dbh_cm <= told.dbh_hi_cm
    assert isinstance(cloud, PointCloud)
    assert told.height_m == pytest.approx(6.5, abs=0.2)
