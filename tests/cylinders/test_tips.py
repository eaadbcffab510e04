"""Tips of twigs end where their wood does, on average, and never far beyond their last point."""

import numpy as np
import pytest

from pipeline.cylinders.anchors import extend_tips
from pipeline.geometry.axes import Axes
from pipeline.geometry.windows import share_out

LENGTH, RADIUS, APART = 0.6, 0.003, 0.5


def twigs(count, per_metre, *, short=0.04, seed=0):
    """A lying stem with upright twigs of 60 cm, strewn at random; their axes end `short` of their wood.

    Returns
    -------
    axes, shared, last : the axes, the points by branch, and the height of each twig's last point
    """
    rng = np.random.default_rng(seed)
    stem = np.column_stack([np.arange(count + 1) * APART, np.zeros((count + 1, 2))])
    z = np.linspace(0, LENGTH - short, 15)
    nodes = [np.column_stack([np.full(15, APART * k), np.zeros(15), z]) for k in range(count)]
    xyz = np.vstack([stem, *nodes])
    first = np.concatenate([[0], count + 1 + 15 * np.arange(count + 1)])
    axes = Axes(xyz, first, np.array([-1, *range(count)]), np.full(len(xyz), RADIUS**2))
    owner = np.repeat(np.arange(count), rng.poisson(per_metre * LENGTH, count))
    height, angle = rng.uniform(0, LENGTH, len(owner)), rng.uniform(0, 2 * np.pi, len(owner))
    ring = RADIUS * np.column_stack([np.cos(angle), np.sin(angle)])
    points = np.column_stack([APART * owner + ring[:, 0], ring[:, 1], height])
    last = np.zeros(count)
    np.maximum.at(last, owner, height)
    return axes, share_out(points, axes), last


def tips(axes):
    return axes.xyz[axes.first[2:] - 1, 2]


@pytest.mark.parametrize("per_metre", [30, 60, 120])
@pytest.mark.parametrize("short", [0.02, 0.05])
def test_twigs_end_where_their_wood_does_on_average(per_metre, short):
    axes, shared, last = twigs(600, per_metre, short=short)
    gap = 1.0 / per_metre
    found = tips(extend_tips(axes, shared, most_m=0.08)) - LENGTH
    assert abs(found.mean()) < gap / 4
    assert (last - LENGTH).mean() < -0.8 * gap  # the last points alone fall short


@pytest.mark.parametrize("most_m", [0.0, 0.01, 0.03])
def test_no_tip_lies_further_beyond_its_last_point(most_m):
    axes, shared, last = twigs(300, 12, seed=3)
    found = tips(extend_tips(axes, shared, most_m=most_m))
    beyond = found - np.maximum(last, tips(axes))
    assert beyond.max() <= most_m + 1e-9
    moved = found - tips(axes)
    assert moved.max() <= 2 * most_m + 1e-9
    assert (moved >= 0).all()
    if most_m:
        assert (beyond > 0.9 * most_m).sum() > 20  # the bound is what holds them


def test_points_beside_the_twig_do_not_lengthen_it():
    axes, shared, _ = twigs(5, 60)
    stray = shared.xyz.copy()
    high = stray[:, 2] > LENGTH - 0.04
    stray[high, 1] += 0.05
    other = type(shared)(stray, shared.arc, shared.first, shared.node_arc, shared.away)
    assert (tips(extend_tips(axes, other, most_m=0.08)) < LENGTH - 0.001).all()


def test_only_tips_move():
    axes, shared, _ = twigs(20, 60)
    found = extend_tips(axes, shared, most_m=0.08)
    tip = axes.first[1:] - 1
    rest = np.setdiff1d(np.arange(len(axes.xyz)), tip)
    np.testing.assert_array_equal(found.xyz[rest], axes.xyz[rest])
    np.testing.assert_array_equal(found.square, axes.square)


def test_a_twig_without_points_stays():
    axes, shared, _ = twigs(3, 60)
    nothing = type(shared)(
        shared.xyz[:0], shared.arc[:0], np.zeros_like(shared.first), shared.node_arc, shared.away[:0]
    )
    np.testing.assert_array_equal(extend_tips(axes, nothing, most_m=0.08).xyz, axes.xyz)
