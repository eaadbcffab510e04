"""From a branch system to nodes: lengths, branches and orders stay."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.geometry.numbering import number_by_paths, renumbered
from pipeline.model import Skeleton
from pipeline.skeleton.minimal.attaching import attach_all, relax
from pipeline.skeleton.minimal.nodes import nodes_of
from pipeline.skeleton.minimal.problem import Axes, Problem, System
from tests.skeleton.minimal.problems import crown


def skeleton_of(system, least_m=0.0):
    xyz, parent, ahead = nodes_of(system, least_m)
    order = number_by_paths(parent, ahead)
    return Skeleton(xyz[order], renumbered(parent, order))


@pytest.mark.parametrize("seed", range(3))
def test_nothing_is_lost(seed):
    system = relax(attach_all(crown(60, seed)))
    skeleton = skeleton_of(system)
    assert skeleton.length.sum() == pytest.approx(11.2 + system.total, abs=0.1)
    assert skeleton.length[1:].min() > 0.0
    rows = [np.argmin(np.linalg.norm(skeleton.xyz - leaf, axis=1)) for leaf in system.problem.leaves]
    assert len(set(rows)) == 60
    np.testing.assert_array_equal(skeleton.order[rows], system.order)


@pytest.mark.parametrize("start", [0.0003, 2.9997])
def test_a_branch_at_the_end_of_its_mother_stays_its_daughter(start):
    """Not its sister where it starts next to the fork, nor its continuation where it starts at the tip."""
    trunk = Axes.trunk(np.array([[0.0, 0, 0], [0, 0, 10.0]]))
    leaves = np.array([[3.0, 0, 5.0], [start, 1.0, 5.0]])
    base, mother = np.array([[0.0, 0, 5.0], [start, 0, 5.0]]), np.array([0, 1])
    system = System(
        Problem(leaves, trunk, np.array([np.pi / 2])),
        mother,
        base,
        np.array([3.0, 1.0]),
        mother + 1,
        np.zeros(2),
    )
    skeleton = skeleton_of(system)
    rows = [np.argmin(np.linalg.norm(skeleton.xyz - leaf, axis=1)) for leaf in leaves]
    assert skeleton.order[rows].tolist() == [1, 2]
    assert len(skeleton.paths) == 3
    assert skeleton.length.sum() == pytest.approx(14.0, abs=0.005)


def test_a_bent_trunk_is_one_branch_with_angles_kept_on_it():
    line = np.array([[0.0, 0, 0], [0.5, 0, 3], [0, 0, 9]])
    trunk = Axes.trunk(line)
    np.testing.assert_allclose(trunk.beyond, [np.hypot(0.5, 6), 0.0])
    leaves = np.array([[1.0, 0.5, 3.5], [0.2, 1.0, 7.0]])
    skeleton = skeleton_of(attach_all(Problem(leaves, trunk, np.radians([45.0]))))
    assert len(skeleton.paths) == 3
    stem = skeleton.xyz[skeleton.paths[0]]
    np.testing.assert_array_equal(stem[[0, -1]], line[[0, 2]])
    assert len(stem) == 5  # foot, two branches, the bend, the top
    assert skeleton.order.max() == 1


def test_short_branches_without_daughters_go():
    system = relax(attach_all(crown(60, 1)))
    all_, few = skeleton_of(system), skeleton_of(system, 1.0)
    assert len(few) < len(all_)
    tips = few.tips[few.order[few.tips] > 0]
    ends = [np.linalg.norm(np.diff(few.xyz[path[[0, -1]]], axis=0)) for path in few.paths[1:]]
    assert min(ends) >= 1.0 or len(tips) < len(ends)
