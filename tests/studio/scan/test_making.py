"""From a wish to what is shown: what a change makes anew, and what is kept."""

import numpy as np
import pytest

from pipeline.config import Config
from pipeline.errors import NotATreeError, PipelineError
from pipeline.exchange import write
from pipeline.model import PointCloud
from pipeline.studio.folders import Folders
from pipeline.studio.scan.fields import changed
from pipeline.studio.scan.making import Maker, Wish, sorted_points


class Stopped(Exception):
    """Raised by whoever is told of stages."""


@pytest.fixture
def maker(folder):
    return Maker(Folders([folder]))


@pytest.fixture
def twig(folder):
    return Wish(folder / "twig.laz", 1)


def quiet(_stage):
    pass


def test_a_cloud_is_reconstructed_with_all_its_figures(maker, twig, grown):
    told = []
    result = maker.make(twig, told.append).result
    assert list(dict.fromkeys(told)) == ["read", "clean", "skeleton", "fit", "sort", "distances"]
    assert result.stages == ("clean", "skeleton", "fit", "rest", "distances")
    assert result.figures["name"] == "twig"
    assert result.figures["height_m"] == pytest.approx(float(grown.skeleton.xyz[:, 2].max()), abs=0.05)
    assert result.figures["seconds"]["fit"] > 0
    assert "peak_rss_mb" not in result.figures
    assert result.off.surface.mean_mm == pytest.approx(result.figures["surface_mm"]["mean"], rel=0.01)
    assert len(result.near) == len(result.used) == result.figures["points_used"]


@pytest.mark.parametrize(
    ("key", "value", "made"),
    [
        ("cylinders.rounds", 1, ("fit", "distances")),
        ("skeleton.slice_m", 0.05, ("skeleton", "fit", "distances")),
        ("clean.voxel_m", 0.02, ("clean", "skeleton", "fit", "rest", "distances")),
    ],
)
def test_stages_before_a_change_are_kept(maker, twig, key, value, made):
    before = maker.make(twig, quiet).result
    after = maker.make(twig._replace(config=changed(Config(), key, value)), quiet).result
    assert after.stages == made
    assert (after.used is before.used) == ("clean" not in made)
    again = maker.make(twig._replace(config=changed(Config(), key, value)), quiet)
    assert again.result is after
    assert maker.make(twig, quiet).result is before
    last = maker.make(twig._replace(config=changed(Config(), "cylinders.stiffness", 2.0)), quiet).result
    assert last.stages == ("fit", "distances")


def test_a_run_is_shown_as_it_is_until_an_option_changes(folder, run_folder):
    maker = Maker(Folders([folder, run_folder.parent]))
    shown = maker.make(Wish(run_folder, 1), quiet)
    assert shown.result.tree is shown.opened.model
    assert shown.result.figures is shown.opened.written
    assert shown.result.off.surface.mean_mm == pytest.approx(
        shown.opened.written["surface_mm"]["mean"], rel=0.05
    )
    same = maker.make(Wish(run_folder, 1, shown.opened.config), quiet)
    assert same.result is shown.result
    other = maker.make(Wish(run_folder, 1, Config()), quiet)
    assert other.result.tree is not shown.opened.model
    assert other.result.stages == ("skeleton", "fit", "distances")


def test_a_model_without_points_is_shown_but_not_made_again(maker, folder):
    wish = Wish(folder / "twig.truth.npz", 1)
    result = maker.make(wish, quiet).result
    assert (result.used, result.off) == (None, None)
    assert result.figures["volume_l"] > 0
    with pytest.raises(NotATreeError, match="no points to reconstruct from; open the cloud"):
        maker.make(wish._replace(config=changed(Config(), "clean.voxel_m", 0.1)), quiet)


def test_two_models_are_compared(maker, twig, folder):
    truth = maker.make(twig._replace(other=folder / "twig.truth.npz"), quiet)
    assert truth.other.name == "twig.truth.npz"
    assert truth.compared.surface.median_mm < 5
    coarse = changed(Config(), "cylinders.rounds", 1)
    other = maker.make(twig._replace(config=coarse, other=Config()), quiet)
    assert other.other is truth.result
    assert other.compared.surface.mean_mm > 0


def test_models_in_different_places_are_compared_by_their_roots(maker, twig, folder, grown):
    from dataclasses import replace

    away = replace(grown, skeleton=replace(grown.skeleton, origin=np.array([5000.0, 0.0, 0.0])))
    write(away, folder / "away.npz")
    with pytest.raises(PipelineError, match="km"):
        maker.make(twig._replace(other=folder / "away.npz"), quiet)
    found = maker.make(twig._replace(other=folder / "away.npz", aligned=True), quiet).compared
    assert found.shift_m == pytest.approx(5000, abs=1)


@pytest.mark.parametrize(("name", "says"), [("three.xyz", "needs at least 10"), ("plane.laz", "plane.laz")])
def test_what_is_no_tree_is_a_sentence(maker, folder, name, says):
    with pytest.raises(PipelineError, match=says) as error:
        maker.make(Wish(folder / name, 1), quiet)
    assert name in str(error.value)


def test_making_ends_where_it_is_told_to(maker, twig):
    def at_fit(stage):
        if stage == "fit":
            raise Stopped

    with pytest.raises(Stopped):
        maker.make(twig, at_fit)
    assert maker.make(twig, quiet).result.stages == ("fit", "rest", "distances")


def test_opening_again_reads_again(maker, twig):
    first = maker.make(twig, quiet)
    assert maker.make(twig, quiet).opened is first.opened
    assert maker.make(twig._replace(turn=2), quiet).opened is not first.opened


def test_points_are_told_apart():
    grid = np.arange(12.0).reshape(4, 3)
    cloud, whole, used = (
        PointCloud(np.vstack([grid, [[np.nan] * 3]])),
        PointCloud(grid[:3]),
        PointCloud(grid[:2]),
    )
    leaves, rest = sorted_points(cloud, whole, used)
    assert leaves.tolist() == [grid[2].tolist()]
    assert rest.tolist() == [grid[3].tolist()]
    leaves, rest = sorted_points(cloud, None, used)
    assert (len(leaves), len(rest)) == (0, 2)
