"""The truth file: chains of cylinders, written and read alike."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pipeline.errors import InputFormatError, InputMissingError, ModelError
from pipeline.formats import model_npz
from pipeline.model import Skeleton, TreeModel
from pipeline.synthetic import (
    Truth,
    TubeTreeOptions,
    grow_tubes,
    holds_truth,
    read_truth,
    tree_of,
    truth_of,
    write_truth,
)


@pytest.fixture(scope="module")
def tree() -> TreeModel:
    return grow_tubes(TubeTreeOptions(seed=9))


def test_a_small_tree_by_hand() -> None:
    xyz = np.array([[0, 0, 0], [0, 0, 1], [0, 0, 2], [0.5, 0, 1]])
    skeleton = Skeleton(xyz, np.array([-1, 0, 1, 1]), np.array([100.0, 200, 3]))
    radius = np.array([0.2, 0.1, 0.05, 0.02])
    truth = truth_of(TreeModel(skeleton, radius, np.zeros(4, dtype=np.uint8), np.zeros(4)))
    assert truth.s.tolist() == [[100, 200, 3], [100, 200, 4], [100, 200, 4]]
    assert truth.e.tolist() == [[100, 200, 4], [100, 200, 5], [100.5, 200, 4]]
    assert truth.r == pytest.approx([0.15, 0.075, 0.02])
    assert (truth.order.tolist(), truth.branch.tolist(), truth.parent.tolist()) == (
        [0, 0, 1],
        [0, 0, 1],
        [-1, 0, 0],
    )


def test_cylinders_hang_together_and_hold_the_volume(tree: TreeModel) -> None:
    truth = truth_of(tree)
    grown = truth.parent >= 0
    np.testing.assert_array_equal(truth.e[truth.parent[grown]], truth.s[grown])
    assert truth.volume_m3 == pytest.approx(float(tree.volume.sum()), rel=1e-3)


def test_what_is_written_is_read_and_the_bytes_repeat(tree: TreeModel, tmp_path: Path) -> None:
    truth = truth_of(tree)
    for name in ("a", "b"):
        write_truth(truth, tmp_path / f"{name}.truth.npz")
    assert (tmp_path / "a.truth.npz").read_bytes() == (tmp_path / "b.truth.npz").read_bytes()
    back = read_truth(tmp_path / "a.truth.npz")
    for key in Truth.__dataclass_fields__:
        np.testing.assert_array_equal(getattr(back, key), getattr(truth, key))


def test_errors_name_the_file(tmp_path: Path) -> None:
    with pytest.raises(InputMissingError, match=r"none\.npz: no such file; give a \.truth\.npz"):
        read_truth(tmp_path / "none.npz")
    for name, content in (("empty.npz", b""), ("text.npz", b"hello"), ("zip.npz", b"PK\x03\x04oh")):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(InputFormatError, match=rf"{name}: is no truth .*it needs the arrays s, e, r"):
            read_truth(tmp_path / name)
    np.savez(tmp_path / "part.npz", s=np.zeros((1, 3)))
    with pytest.raises(InputFormatError, match=r"part\.npz: is no truth"):
        read_truth(tmp_path / "part.npz")
    arrays = {key: np.zeros((2, 3) if key in "se" else 2) for key in Truth.__dataclass_fields__}
    np.savez(tmp_path / "long.npz", **{**arrays, "order": np.zeros(3)})
    with pytest.raises(
        InputFormatError, match=r"long\.npz: order has shape \(3,\) beside 2 radii; write the truth"
    ):
        read_truth(tmp_path / "long.npz")
    np.save(tmp_path / "one.npy", np.zeros(3))
    with pytest.raises(InputFormatError, match=r"one\.npy: is no truth"):
        read_truth(tmp_path / "one.npy")


def test_a_tree_of_a_truth_is_the_tree(tree: TreeModel) -> None:
    truth = truth_of(tree)
    back = truth_of(tree_of(truth))
    for key in ("s", "e", "order", "branch", "parent"):
        np.testing.assert_allclose(getattr(back, key), getattr(truth, key), atol=1e-12)
    assert np.abs(back.r - truth.r).max() < 0.003
    assert back.volume_m3 == pytest.approx(truth.volume_m3, rel=0.01)


def test_a_branch_that_starts_within_a_cylinder_starts_there() -> None:
    s = np.array([[100.0, 200, 0], [100, 200, 1], [100, 200, 0.4], [100.5, 200, 0.4]])
    e = np.array([[100.0, 200, 1], [100, 200, 2], [100.5, 200, 0.4], [101, 200, 0.4]])
    truth = Truth(
        s,
        e,
        np.array([0.2, 0.1, 0.03, 0.01]),
        np.array([0, 0, 1, 1]),
        np.array([0, 0, 1, 1]),
        np.array([-1, 0, 0, 2]),
    )
    made = tree_of(truth)
    assert made.skeleton.origin.tolist() == [100, 200, 0]
    assert made.skeleton.parent.tolist() == [-1, 0, 1, 2, 1, 4]
    assert made.skeleton.xyz[1].tolist() == pytest.approx([0, 0, 0.4])
    assert made.skeleton.order.tolist() == [0, 0, 0, 0, 1, 1]
    assert made.radius == pytest.approx([0.2, 0.2, 0.15, 0.1, 0.02, 0.01])
    with pytest.raises(ModelError, match="parents first"):
        tree_of(Truth(s, e, truth.r, truth.order, truth.branch, np.array([1, -1, 0, 2])))


def test_a_truth_is_told_from_a_model(tree: TreeModel, tmp_path: Path) -> None:
    write_truth(truth_of(tree), tmp_path / "a.npz")
    model_npz.write(tree, tmp_path / "b.npz")
    (tmp_path / "c.npz").write_bytes(b"hello")
    held = [holds_truth(tmp_path / f"{name}.npz") for name in "abcd"]
    assert held == [True, False, False, False]
