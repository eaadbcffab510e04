"""Trees that grow into free space: repeatable, of the shape asked for, and clear about why they stop."""

from __future__ import annotations

import numpy as np
import pytest
from pydantic import ValidationError

from pipeline.lsystem import canonical
from pipeline.synthetic import kind_named
from pipeline.synthetic.colonization import PRESETS, ColonizationOptions, grow, grow_colonization
from pipeline.synthetic.colonization.envelope import crown_height, crown_points, crown_volume, point_density
from pipeline.synthetic.colonization.growth import stem_nodes
from pipeline.synthetic.colonization.schedule import influence, kill_distances, kill_limits, sigmoid_steps

QUICK = {"crown_width_m": 2.0, "crown_height_m": 2.0, "crown_depth_m": 2.0, "density_begin": 0.3}


def quick(**changes):
    return ColonizationOptions(**{**QUICK, **changes})


@pytest.mark.parametrize("seed", [1, 2, 33])
def test_a_seed_gives_one_tree(seed):
    one, two = (grow_colonization(quick(seed=seed)) for _ in range(2))
    assert one.skeleton.xyz.tobytes() == two.skeleton.xyz.tobytes()
    assert one.radius.tobytes() == two.radius.tobytes()
    other = grow_colonization(quick(seed=seed + 1))
    assert one.skeleton.xyz.tobytes() != other.skeleton.xyz.tobytes()


@pytest.mark.parametrize("name", ["decurrent", "excurrent", "bush", "pendulous", "gnarly"])
def test_presets_grow_from_many_seeds(name):
    for seed in range(4):
        tree = grow_colonization(ColonizationOptions(**{**PRESETS[name], "seed": seed}))
        assert len(tree) > 500
        assert tree.metadata["stop_reason"] in {"max_iter", "stalled", "exhausted"}
        assert canonical(tree) is tree  # numbered path by path


def test_presets_are_what_the_kind_offers():
    kind = kind_named("colonization")
    assert sorted(kind.presets) == ["bush", "decurrent", "excurrent", "gnarly", "pendulous"]
    assert kind.preset("bush")["stem_length_m"] == 0.0


def test_the_excurrent_tree_has_one_stem_to_its_top():
    options = ColonizationOptions(**PRESETS["excurrent"])
    skeleton = grow_colonization(options).skeleton
    stem = skeleton.xyz[skeleton.order == 0]
    assert stem[:, 2].max() == pytest.approx(1.0 + crown_height(options), rel=0.05)
    assert np.linalg.norm(stem[:, :2], axis=1).max() < 1.0
    below, above = skeleton.xyz[skeleton.xyz[:, 2] < 5], skeleton.xyz[skeleton.xyz[:, 2] > 10]
    assert np.ptp(below[:, 0]) > 1.5 * np.ptp(above[:, 0])  # a cone


def test_the_decurrent_tree_dissolves_into_limbs():
    tree = grow_colonization(ColonizationOptions(**PRESETS["decurrent"]))
    limbs = tree.radius[tree.skeleton.branch_start & (tree.skeleton.order == 1)]
    assert np.sort(limbs)[-3:].min() > 0.25 * tree.radius[0]


def test_age_adds_nodes_and_changes_none():
    options = {**QUICK, "density_begin": 0.5, "density_end": 0.5}  # the kill distance does not depend on age
    young, _ = grow(ColonizationOptions(**options, iterations=6))
    old, _ = grow(ColonizationOptions(**options, iterations=12))
    assert len(old.xyz) > len(young.xyz)
    np.testing.assert_array_equal(old.xyz[: len(young.xyz)], young.xyz)


def test_gnarly_branches_bend_more():
    def bend(gnarliness):
        skeleton = grow_colonization(ColonizationOptions(density_begin=0.15, gnarliness=gnarliness)).skeleton
        step = skeleton.xyz[1:] - skeleton.xyz[skeleton.parent[1:]]
        goes_on = ~skeleton.branch_start[1:] & (skeleton.parent[1:] > 0)
        ahead, back = step[goes_on], step[skeleton.parent[1:][goes_on] - 1]
        return np.median(np.arccos(np.clip((ahead * back).sum(axis=1) / 0.25**2, -1, 1)))

    assert bend(1.0) > 1.2 * bend(0.2)


def test_kill_schedule_of_the_thesis():
    steps = sigmoid_steps(2.0, 1.2, 30, (-8.0, 8.0))
    np.testing.assert_allclose(steps[[0, 14, 29]], [1.9997, 1.6548, 1.2003], atol=5e-5)


@pytest.mark.parametrize("gnarliness", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("interpolation", ["squared", "linear"])
def test_kill_distances_stay_between_their_limits_and_below_influence(gnarliness, interpolation):
    least, most = kill_limits(gnarliness)
    for begin, end in [(0.0, 1.0), (1.0, 0.0)]:
        options = ColonizationOptions(
            gnarliness=gnarliness, density_begin=begin, density_end=end, kill_interpolation=interpolation
        )
        kill = kill_distances(options)
        assert (np.diff(kill) < 0).all() if begin < end else (np.diff(kill) > 0).all()
        assert least <= kill.min() < kill.max() <= most < influence(gnarliness)


def test_points_fill_the_cut_ellipsoid():
    options = ColonizationOptions(cutoff_bottom=0.3, cutoff_top=0.1)
    points = crown_points(options, np.array([1.0, 2.0, 3.0]), np.random.default_rng(1))
    assert len(points) == np.ceil(crown_volume(options) * point_density(options))
    unit = (points - [1.0, 2.0, 3.0 + 0.4 * 7.0]) / [5.0, 4.5, 7.0]  # the cut bottom is 0.4 below the middle
    assert np.linalg.norm(unit, axis=1).max() <= 1
    assert unit[:, 2].min() == pytest.approx(-0.4, abs=0.01)
    assert unit[:, 2].max() == pytest.approx(0.8, abs=0.01)


def test_volume_of_an_uncut_crown():
    options = ColonizationOptions(cutoff_bottom=0.0, cutoff_top=0.0)
    assert crown_volume(options) == pytest.approx(4 / 3 * np.pi * 5 * 7 * 4.5)


def test_a_wider_crown_has_the_same_points_farther_out():
    narrow, wide = (
        crown_points(ColonizationOptions(crown_width_m=width), np.zeros(3), np.random.default_rng(1))
        for width in (4.0, 8.0)
    )
    np.testing.assert_allclose(wide[: len(narrow)], narrow * [2.0, 1.0, 1.0])


def test_points_on_the_rim_alone():
    options = ColonizationOptions(rim_share=0.2, cutoff_bottom=0.0, cutoff_top=0.0)
    points = crown_points(options, np.zeros(3), np.random.default_rng(1))
    away = np.linalg.norm((points - [0, 0, 7.0]) / [5.0, 4.5, 7.0], axis=1)
    assert 0.8 <= away.min() < away.max() <= 1.0
    assert len(points) == pytest.approx(crown_volume(options) * point_density(options) * (1 - 0.8**3), abs=1)


def test_a_rough_rim_goes_in_and_out():
    options = ColonizationOptions(rim_noise=0.3, rim_share=0.1, cutoff_bottom=0.0, cutoff_top=0.0)
    points = crown_points(options, np.zeros(3), np.random.default_rng(1))
    away = np.linalg.norm((points - [0, 0, 7.0]) / [5.0, 4.5, 7.0], axis=1)
    assert away.min() < 0.85
    assert away.max() > 1.15


@pytest.mark.parametrize(("length", "count"), [(0.0, 1), (0.1, 2), (2.0, 9)])
def test_stem(length, count):
    nodes, entered = stem_nodes(ColonizationOptions(stem_length_m=length), np.random.default_rng(1))
    assert len(nodes) == count == entered + 1
    np.testing.assert_allclose(np.linalg.norm(np.diff(nodes, axis=0), axis=1).sum(), length)


def test_progress_and_the_reason_to_stop():
    told = []
    tree = grow_colonization(quick(iterations=7), told.append)
    assert [step.done for step in told] == list(range(1, 8))
    assert tree.metadata["stop_reason"] == "max_iter"
    assert 0 < tree.metadata["unused"] < 1


def test_a_tip_that_sees_no_more_points_says_so():
    tree = grow_colonization(
        ColonizationOptions(gnarliness=1.0, density_begin=0.0, crown_width_m=20, iterations=100)
    )
    assert tree.metadata["stop_reason"] in {"out_of_reach", "stalled"}
    assert tree.metadata["iterations"] < 100


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"iterations": 101}, "less than or equal to 100"),
        ({"crown_width_m": 0.5}, "greater than or equal to 1"),
        ({"gnarliness": 1.5}, "less than or equal to 1"),
        ({"leaves_per_node": 11}, "less than or equal to 10"),
        ({"ring_sides": 2}, "greater than or equal to 3"),
        (
            {"cutoff_top": 0.5, "cutoff_bottom": 0.45},
            "leave nothing of the crown; their sum must be below 0.95",
        ),
        ({"iterations": 0, "stem_length_m": 0}, "a tree of one node; raise one"),
        ({"leaf_colour": "blue"}, "Input should be 'green'"),
        ({"cutof_top": 0.1}, "Extra inputs are not permitted"),
    ],
)
def test_wrong_parameters_are_named_with_their_range(wrong, words):
    with pytest.raises(ValidationError, match=words):
        ColonizationOptions(**wrong)


def test_every_parameter_says_what_it_is():
    for name, field in ColonizationOptions.model_fields.items():
        assert field.description, name
        if name.endswith("_m"):
            assert "metres" in field.description, name
        if name.endswith("_deg"):
            assert "degrees" in field.description, name
