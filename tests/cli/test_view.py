"""`treepipe view`: pictures and pages of everything that is read."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from pipeline.cli.main import main as treepipe
from pipeline.exchange import read_model, write

SAMPLES = Path(__file__).resolve().parents[2] / "data" / "samples"


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("view")
    tree = read_model(SAMPLES / "maple.truth.npz")
    out = {"cloud": SAMPLES / "maple.laz"}
    for kind, suffix in (("tree", ".ls.json"), ("skeleton", ".skeleton.ply"), ("mesh", ".mesh.ply")):
        out[kind] = folder / f"maple{suffix}"
        write(tree, out[kind])
    return out


def call(capsys, *words):
    with pytest.raises(SystemExit) as ended:
        treepipe([str(word) for word in words])
    return ended.value.code, capsys.readouterr().err


@pytest.mark.parametrize("kind", ["cloud", "tree", "skeleton", "mesh"])
def test_a_screenshot_shows_something(kind, files, tmp_path, capsys):
    target = tmp_path / "seen.png"
    code, _ = call(capsys, "view", files[kind], "--screenshot", target)
    assert code == 0
    seen = np.asarray(Image.open(target).convert("L"))
    assert 0.001 < (seen < 250).mean() < 0.7


def test_a_page_holds_all_it_needs(files, tmp_path, capsys):
    target = tmp_path / "tree.html"
    assert call(capsys, "view", files["tree"], "--html", target)[0] == 0
    text = target.read_text(encoding="utf-8")
    assert "standard error of the radius" in text
    assert 'src="' not in text
    code, told = call(capsys, "view", files["cloud"], "--html", tmp_path / "cloud.html")
    assert code == 2
    assert "--screenshot" in told


def test_without_a_display_the_remedy_is_named(files, capsys, monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    code, told = call(capsys, "view", files["tree"])
    assert code == 1
    assert "--screenshot" in told


def test_wrong_suffix_and_missing_file(files, tmp_path, capsys):
    code, told = call(capsys, "view", files["tree"], "--screenshot", tmp_path / "a.jpeg")
    assert code == 2
    assert ".png" in told
    code, told = call(capsys, "view", tmp_path / "none.laz", "--screenshot", tmp_path / "a.png")
    assert code == 1
    assert "none.laz" in told
