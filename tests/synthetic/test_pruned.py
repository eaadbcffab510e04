"""Trees with a gardener: their truth shows what was done."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.synthetic import kind_named, tree_of, truth_of


@pytest.mark.parametrize("name", ["pruned", "espalier"])
def test_the_seed_alone_decides_and_the_truth_holds_the_tree(name: str) -> None:
    kind = kind_named(name)
    one, same, other = (kind.grow(kind.options(seed=seed, years=12)) for seed in (3, 3, 4))
    assert one.skeleton.xyz.tobytes() == same.skeleton.xyz.tobytes()
    assert one.skeleton.xyz.tobytes() != other.skeleton.xyz.tobytes()
    back = tree_of(truth_of(one))
    assert back.skeleton.length.sum() == pytest.approx(one.skeleton.length.sum())


def test_an_espalier_is_flat() -> None:
    kind = kind_named("espalier")
    tree = kind.grow(kind.options(wall_deg=90.0))
    extent = np.ptp(tree.skeleton.xyz, axis=0)
    assert extent[1] > 2.5
    assert extent[0] < 0.25 * extent[1]
    assert extent[2] < 2.5


def test_a_street_tree_has_a_clear_stem() -> None:
    kind = kind_named("pruned")
    tree = kind.grow(kind.options(**kind.preset("excurrent")))
    graph = tree.skeleton
    low = graph.xyz[graph.parent[1:], 2] < 1.2 - 1e-9
    assert (graph.order[1:][low] == 0).all()


def test_an_open_tree_is_lower_and_wider_than_one_left_alone() -> None:
    kind = kind_named("pruned")
    for seed in range(3):
        opened = np.ptp(kind.grow(kind.options(seed=seed, thin_share=0.0)).skeleton.xyz, axis=0)
        alone = np.ptp(kind.grow(kind.options(seed=seed, open_year=0, thin_share=0.0)).skeleton.xyz, axis=0)
        assert opened[2] < alone[2]
        assert opened[:2].max() / opened[2] > alone[:2].max() / alone[2]
