"""Dropped nodes lie within their tolerance of the axis that is left."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.cylinders.assembly import LEAST_M, Tolerance, chosen_nodes
from pipeline.geometry.axes import Axes

TOLERANCE = Tolerance(share=0.15, radius_share=0.08, cap_m=0.007, radius_cap_m=0.0012)
NONE = np.array([], dtype=np.int64)


def crooked(seed=0, branches=6, count=50):
    """A stem and branches whose axes wander, tapering."""
    rng = np.random.default_rng(seed)
    xyz, foot, radius = [], [-1], []
    for b in range(branches):
        start = np.zeros(3)
        if b:
            on = int(rng.integers(0, b))
            foot.append(on * count + int(rng.integers(1, count)))
            start = xyz[on][foot[-1] - on * count]
        heading = rng.normal(size=3)
        way = heading / np.linalg.norm(heading) + np.cumsum(rng.normal(0, 0.08, (count - 1, 3)), axis=0)
        xyz.append(np.vstack([start, start + np.cumsum(0.04 * way, axis=0)]))
        radius.append(0.1 / (b + 1) * np.linspace(1, 0.2, count))
    first = count * np.arange(branches + 1)
    return Axes(np.vstack(xyz), first, np.array(foot), np.concatenate(radius) ** 2)


def off_the_chain(axes, chosen):
    """(M,) distance of every node to the simplified axis of its branch."""
    kept = np.zeros(len(axes.xyz), dtype=bool)
    kept[chosen] = True
    out = np.empty(len(axes.xyz))
    for low, high in zip(axes.first[:-1], axes.first[1:], strict=True):
        chain = axes.xyz[low:high][kept[low:high]]
        start, along = chain[:-1], np.diff(chain, axis=0)
        off = axes.xyz[low:high, None] - start
        share = np.clip((off * along).sum(axis=2) / (along**2).sum(axis=1), 0, 1)
        out[low:high] = np.linalg.norm(off - share[..., None] * along, axis=2).min(axis=1)
    return out


def allowed(axes, least):
    return np.maximum(np.minimum(0.15 * axes.radius, 0.007), np.maximum(least, LEAST_M))


@given(st.integers(0, 1000), st.floats(0, 0.05))
def test_dropped_nodes_lie_within_the_tolerance(seed, least):
    axes = crooked(seed)
    chosen = chosen_nodes(axes, TOLERANCE, np.full(len(axes.xyz), least), NONE)
    assert (off_the_chain(axes, chosen) <= allowed(axes, least) * (1 + 1e-9)).all()


def test_every_node_has_a_tolerance_of_its_own():
    axes = crooked(3)
    least = np.where(np.arange(len(axes.xyz)) % 2, 0.05, 0.0)
    chosen = chosen_nodes(axes, TOLERANCE, least, NONE)
    off = off_the_chain(axes, chosen)
    assert (off <= allowed(axes, least) * (1 + 1e-9)).all()
    assert off.max() > 0.007  # where more is left open, more is used


def test_radii_are_kept_by_their_own_tolerance():
    straight = np.column_stack([np.zeros((41, 2)), np.linspace(0, 1.6, 41)])
    radius = 0.1 - 0.02 * np.sin(np.linspace(0, 6, 41))
    axes = Axes(straight, np.array([0, 41]), np.array([-1]), radius**2)
    chosen = chosen_nodes(axes, TOLERANCE, np.zeros(41), NONE)
    between = np.interp(straight[:, 2], straight[chosen, 2], radius[chosen])
    assert np.abs(between - radius).max() <= 0.0012 + 1e-9
    assert len(chosen) < 41
    flat = Axes(straight, axes.first, axes.foot, np.full(41, 0.01))
    assert chosen_nodes(flat, TOLERANCE, np.zeros(41), NONE).tolist() == [0, 40]


@pytest.mark.parametrize("seed", range(5))
def test_the_more_is_left_open_the_fewer_nodes_stay(seed):
    axes = crooked(seed)
    counts = [
        len(chosen_nodes(axes, TOLERANCE, np.full(len(axes.xyz), least), NONE))
        for least in (0.0, 0.005, 0.015, 0.05, 0.2)
    ]
    assert counts[0] > 1.5 * counts[2] > 1.5 * counts[3]
    assert (np.diff(counts) <= 0).all()


@given(st.integers(0, 1000), st.lists(st.integers(0, 299), max_size=10))
def test_feet_ends_and_whatever_must_stay(seed, always):
    axes = crooked(seed)
    chosen = chosen_nodes(axes, TOLERANCE, np.full(300, 1.0), np.array(always, dtype=np.int64))
    must = {*always, *axes.foot[1:], *axes.first[:-1], *(axes.first[1:] - 1)}
    assert set(chosen.tolist()) >= {int(node) for node in must}
    assert (np.diff(chosen) > 0).all()
    assert len(chosen) <= len(must) + 20  # all else is left open
