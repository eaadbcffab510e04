"""The parts of the spanning-tree method on hand-made branches."""

import numpy as np
import pytest

from pipeline.skeleton.centring import centre
from pipeline.skeleton.graph import by_neighbours
from pipeline.skeleton.pruning import prune
from pipeline.skeleton.rooted import Rooted, by_minimum_spanning_tree, by_shortest_paths, find_root
from pipeline.skeleton.simplification import merge_siblings, simplify


def bark(radius, height, density, seed=0):
    rng = np.random.default_rng(seed)
    count = int(2 * np.pi * radius * height * density)
    angle, z = rng.uniform(0, 2 * np.pi, count), rng.uniform(0, height, count)
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), z])


@pytest.mark.parametrize("radius", [0.02, 0.08, 0.25])
def test_centring_finds_the_axis_and_the_thickness_whatever_they_are(radius):
    height = max(4.0, 60 * radius)  # no stem is stouter than that
    xyz = bark(radius, height, 2000)
    centred = centre(xyz, spacing_m=0.02, rounds=2)
    inner = (xyz[:, 2] > 2 * radius) & (xyz[:, 2] < height - 2 * radius)
    off_axis = np.linalg.norm(centred.xyz[inner, :2], axis=1)
    assert np.median(off_axis) < 0.15 * radius + 0.003
    assert np.median(centred.thickness[inner]) == pytest.approx(radius, rel=0.15)


def test_centring_does_not_shorten_a_branch():
    xyz = bark(0.03, 2.0, 6000)
    centred = centre(xyz, spacing_m=0.012, rounds=2)
    assert np.ptp(centred.xyz[:, 2]) == pytest.approx(2.0, abs=0.03)


def chain(start, end, count, thickness, parent=-1, first=0):
    xyz = np.linspace(start, end, count)
    above = np.r_[parent, np.arange(first, first + count - 1)]
    return xyz, above, np.full(count, thickness)


def join(*parts):
    xyz, parent, thickness = (np.concatenate(values) for values in zip(*parts, strict=True))
    return Rooted(xyz, parent, thickness, np.full(len(xyz), 3.0))


def test_a_chain_within_its_parents_wood_goes_and_a_branch_stays():
    stem = chain([0, 0, 0], [0, 0, 4], 41, 0.10)
    inside = chain([0.03, 0, 1.05], [0.09, 0, 1.6], 6, 0.10, parent=10, first=41)
    branch = chain([0, 0.1, 2.0], [0, 1.0, 2.5], 10, 0.02, parent=20, first=47)
    kept = prune(join(stem, inside, branch), protrusion_m=0.03, inside=1.25, min_support=4)
    assert len(kept.parent) == 51
    assert (kept.parent[1:] < np.arange(1, 51)).all()
    assert kept.xyz[-1].tolist() == [0, 1.0, 2.5]


def test_a_branch_with_too_few_points_goes():
    stem = chain([0, 0, 0], [0, 0, 4], 41, 0.10)
    branch = chain([0, 0.2, 2.0], [0, 0.3, 2.1], 2, 0.02, parent=20, first=41)
    tree = join(stem, branch)
    assert len(prune(tree, protrusion_m=0.03, inside=1.25, min_support=7).parent) == 41
    assert len(prune(tree, protrusion_m=0.03, inside=1.25, min_support=6).parent) == 43


def test_simplifying_keeps_forks_and_tips_and_straightens_between():
    stem = chain([0, 0, 0], [0, 0, 4], 41, 0.10)
    branch = chain([0, 0.1, 2.0], [0, 1.0, 2.5], 10, 0.02, parent=20, first=41)
    small = simplify(join(stem, branch), share=0.3, floor_m=0.005)
    assert len(small.parent) == 5  # root, fork, top, the branch's first bend, its tip
    assert small.support.sum() == pytest.approx(51 * 3)


def test_near_parallel_siblings_become_one():
    xyz = np.array([[0, 0, 0], [0, 0, 1], [0.05, 0, 2], [-0.05, 0, 2.0], [0, 0, 3]])
    tree = Rooted(xyz, np.array([-1, 0, 1, 1, 3]), np.full(5, 0.2), np.array([1.0, 1, 1, 2, 0]))
    one = merge_siblings(tree, min_cosine=0.9, max_ratio=2.0)
    assert one.parent.tolist() == [-1, 0, 1, 2]
    np.testing.assert_allclose(one.xyz[2], [-1 / 60, 0, 2], atol=1e-12)


def test_siblings_farther_apart_than_their_thickness_stay_two():
    xyz = np.array([[0, 0, 0], [0, 0, 1], [0.3, 0, 2], [-0.3, 0, 2.0]])
    tree = Rooted(xyz, np.array([-1, 0, 1, 1]), np.full(4, 0.1), np.ones(4))
    assert len(merge_siblings(tree, min_cosine=0.5, max_ratio=2.0).parent) == 4


def test_the_root_is_the_foot_of_the_stem_and_not_a_lone_low_point():
    rng = np.random.default_rng(0)
    stem = np.column_stack([rng.normal(0, 0.01, (50, 2)), np.linspace(0, 5, 50)])
    low = np.array([[0.6, 0.4, -0.25]])
    xyz = np.vstack([low, stem])
    thickness, support = np.r_[0.01, np.full(50, 0.1)], np.r_[1.0, np.full(50, 20.0)]
    assert find_root(xyz, thickness, support) == 1


def test_both_trees_span_every_node_with_parents_first():
    xyz = np.random.default_rng(0).normal(size=(200, 3))
    graph = by_neighbours(xyz, 8)
    for walk in (by_minimum_spanning_tree, by_shortest_paths):
        order, before = walk(graph, 7)
        assert order[0] == 7
        assert sorted(order.tolist()) == list(range(200))
        place = np.argsort(order)
        others = order[1:]
        assert (place[before[others]] < place[others]).all()
