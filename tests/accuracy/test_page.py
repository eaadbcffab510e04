"""The page stands alone, holds what it shows, and draws."""

from __future__ import annotations

import base64
import json
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from pipeline.accuracy import compare, compare_cloud
from pipeline.accuracy.page import page, scale_end
from pipeline.accuracy.plots import along_path, histogram, ticks
from pipeline.model import PointCloud
from tests.accuracy.conftest import changed


class Reader(HTMLParser):
    """Gathers tags, what they refer to, and the text of scripts."""

    VOID = ("meta", "link", "input", "rect", "line", "path", "polygon", "polyline", "circle", "br")

    def __init__(self, text):
        super().__init__()
        self.open, self.links, self.scripts, self.counts = [], [], [], {}
        self.feed(text)
        self.close()
        assert not self.open

    def handle_starttag(self, tag, attrs):
        """Take a tag."""
        self.counts[tag] = self.counts.get(tag, 0) + 1
        self.links += [value for key, value in attrs if key in {"src", "href"}]
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        """Take a tag that closes itself."""
        del tag
        self.links += [value for key, value in attrs if key in {"src", "href"}]

    def handle_endtag(self, tag):
        """Make sure that tags are closed in order."""
        assert self.open.pop() == tag

    def handle_data(self, data):
        """Take a text."""
        if self.open[-1:] == ["script"]:
            self.scripts.append(data)


@pytest.fixture(scope="module")
def shaken(tree):
    graph = tree.skeleton
    step = np.random.default_rng(0).normal(0, 0.004, graph.xyz.shape)
    return changed(tree, xyz=graph.xyz + step)


@pytest.fixture(scope="module")
def text(tree, shaken):
    return page(compare(shaken, tree), a="<i>a</i>.ply", b="b & c.ply")


def test_it_asks_nothing_of_the_network(text):
    read = Reader(text)
    assert read.links == ["data:,"]
    assert "http" not in text.replace('xmlns="http', "")
    assert "<i>a</i>" not in text
    assert "&lt;i&gt;a&lt;/i&gt;.ply against b &amp; c.ply" in text
    assert read.counts["svg"] == 6  # three kinds of deviation, each by path length and as a histogram


def test_it_holds_the_tree(text, tree, shaken):
    held = json.loads(Reader(text).scripts[0])
    wood = np.frombuffer(base64.b64decode(held["wood"]), dtype="<f4").reshape(-1, 8)
    assert len(wood) == len(tree) - 1
    assert np.linalg.norm(wood[:, 3:6] - wood[:, :3], axis=1) == pytest.approx(
        shaken.skeleton.length[1:], abs=1e-5
    )
    names = [layer["name"] for layer in held["layers"]]
    assert names == ["nodes", "axes", "surfaces"]
    value = np.frombuffer(base64.b64decode(held["layers"][0]["value"]), dtype="<f4")
    step = np.linalg.norm(shaken.skeleton.xyz - tree.skeleton.xyz, axis=1)[1:]
    assert value == pytest.approx(1000 * step, abs=1e-3)


def test_points_are_drawn_too(tree):
    cloud = PointCloud(tree.skeleton.xyz + [0.01, 0, 0])
    held = json.loads(Reader(page(compare_cloud(tree, cloud), a="a", b="b")).scripts[0])
    assert len(base64.b64decode(held["points"])) == 16 * len(tree)


def test_a_skeleton_has_a_page(tree):
    read = Reader(page(compare(tree.skeleton, tree.skeleton), a="a", b="b"))
    assert read.counts["svg"] == 4
    Reader(page(compare_cloud(tree.skeleton, PointCloud(tree.skeleton.xyz)), a="a", b="b"))


def test_plots_by_hand():
    assert ticks(1.0) == [0.0, 0.2, 0.4, 0.6, 0.8, 1.0]
    assert histogram(np.array([1.0, 2.0, np.nan])).count("<rect") == 40
    assert histogram(np.array([])) == along_path(np.array([]), np.array([])) == "<p>none</p>"
    assert along_path(np.arange(50.0), np.arange(50.0)).count("<circle") == 50
    assert scale_end(np.array([np.nan])) == 1.0


CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium; install the package chromium to draw the page")
def test_a_browser_draws_it(text, tmp_path):
    file: Path = tmp_path / "page.html"
    # the browser tells how many pixels of the canvas are not paper
    probe = (
        "<script>const all = pen.getImageData(0, 0, canvas.width, canvas.height).data; let ink = 0;"
        "for (let i = 0; i < all.length; i += 4) if (all[i] < 200) ink++;"
        "document.body.dataset.ink = ink;</script></body>"
    )
    file.write_text(text.replace("</body>", probe), encoding="utf-8")
    call = [
        CHROMIUM,
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        f"--user-data-dir={tmp_path / 'profile'}",
    ]
    done = subprocess.run(
        [*call, "--window-size=1000,900", "--dump-dom", file.as_uri()],
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )
    assert 'data-drawn="yes"' in done.stdout
    assert int(done.stdout.split('data-ink="')[1].split('"')[0]) > 1000
