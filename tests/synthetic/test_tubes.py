"""Trees from a seed: the same every time, numbered path by path, thinner towards the tips."""

from __future__ import annotations

import numpy as np
import pytest
from pydantic import ValidationError

from pipeline.lsystem import canonical
from pipeline.synthetic import TubeTreeOptions, grow_tubes


@pytest.mark.parametrize("seed", [1, 2, 33])
def test_a_seed_gives_one_tree(seed: int) -> None:
    one, two = (grow_tubes(TubeTreeOptions(seed=seed)) for _ in range(2))
    assert one.skeleton.xyz.tobytes() == two.skeleton.xyz.tobytes()
    assert one.radius.tobytes() == two.radius.tobytes()
    other = grow_tubes(TubeTreeOptions(seed=seed + 1))
    assert one.skeleton.xyz.tobytes() != other.skeleton.xyz.tobytes()


def test_the_default_tree_looks_like_a_tree() -> None:
    for seed in range(5):
        tree = grow_tubes(TubeTreeOptions(seed=seed))
        skeleton = tree.skeleton
        assert 60 <= len(skeleton.paths) <= 250
        assert set(skeleton.order) == {0, 1, 2, 3}
        assert skeleton.xyz[:, 2].max() == pytest.approx(7.0, rel=0.15)
        assert skeleton.xyz[:, 2].min() == 0
        assert np.allclose(skeleton.length[1:], 0.07)
        assert tree.radius[0] == pytest.approx(0.10, rel=0.2)
        assert tree.radius[skeleton.tips] == pytest.approx(0.003, abs=0.002)


def test_branches_are_numbered_breadth_first() -> None:
    tree = grow_tubes(TubeTreeOptions(seed=5, fork=0.3))
    assert canonical(tree) is tree
    assert (np.diff(tree.skeleton.order) >= 0).all()


def test_nothing_is_thicker_than_what_carries_it() -> None:
    tree = grow_tubes(TubeTreeOptions(seed=6))
    parent = tree.skeleton.parent[1:]
    assert (tree.radius[1:] <= tree.radius[parent]).all()
    assert tree.radius.min() >= 0.003


def test_a_fork_is_a_second_leader() -> None:
    plain, forked = (grow_tubes(TubeTreeOptions(seed=7, fork=share)) for share in (0, 0.4))
    longest = [max(len(path) for path in tree.skeleton.paths[1:]) * 0.07 for tree in (plain, forked)]
    assert longest[0] < 0.45 * 7
    assert longest[1] == pytest.approx(0.85 * 0.6 * 7, abs=0.15)


def test_a_lean_leans() -> None:
    tree = grow_tubes(TubeTreeOptions(seed=8, lean_deg=20, max_order=0))
    direction = tree.skeleton.xyz[3] / np.linalg.norm(tree.skeleton.xyz[3])
    assert np.degrees(np.arccos(direction[2])) == pytest.approx(20, abs=4)
    assert len(tree.skeleton.paths) == 1


def test_options_are_checked() -> None:
    with pytest.raises(ValidationError, match="height_m"):
        TubeTreeOptions(height_m=0)
