"""Leaves: at the tips, the same for the same seed, hanging and facing the sky."""

from __future__ import annotations

import numpy as np
import pytest
from pydantic import ValidationError

from pipeline.mesh import Mesh, MeshOptions, build, tubes
from pipeline.synthetic import TubeTreeOptions, grow_tubes
from tests.mesh.trees import axis_of, tree_of

TREE = grow_tubes(TubeTreeOptions(seed=4))


def leaves_of(**options: object) -> Mesh:
    mesh = build(TREE, options=MeshOptions.model_validate({"leaves": "quads", **options}))
    return mesh.only(mesh.leaf)


def test_bark_stays_as_it_is_and_leaves_follow() -> None:
    mesh, bark = build(TREE, options=MeshOptions(leaves="quads")), tubes(TREE)
    count = len(bark.faces)
    assert np.array_equal(mesh.vertices[: len(bark.vertices)], bark.vertices)
    assert np.array_equal(mesh.faces[:count], bark.faces)
    assert not mesh.leaf[:count].any()
    assert mesh.leaf[count:].all()
    assert mesh.branch_volume == pytest.approx(bark.branch_volume)


@pytest.mark.parametrize(("shape", "triangles"), [("quads", 2), ("crosses", 4)])
def test_as_many_as_asked_for_on_every_twig(shape: str, triangles: int) -> None:
    leaves = leaves_of(leaves=shape, leaves_per_tip=5)
    per_branch = np.bincount(leaves.branch, minlength=len(TREE.skeleton.paths))
    assert (per_branch == 5 * triangles).all()
    assert len(leaves.vertices) == 2 * len(leaves.faces)


def test_the_seed_decides() -> None:
    assert np.array_equal(leaves_of(seed=3).vertices, leaves_of(seed=3).vertices)
    assert not np.array_equal(leaves_of(seed=3).vertices, leaves_of(seed=4).vertices)


def test_leaves_grow_near_the_tips() -> None:
    size, zone = 0.1, 0.25
    leaves = leaves_of(leaf_size_m=size, leaf_zone_m=zone)
    base = leaves.vertices.reshape(-1, 4, 3)[:, 0]
    tips = np.array([TREE.skeleton.xyz[path[-1]] for path in TREE.skeleton.paths])
    twig = leaves.branch[::2]
    assert np.linalg.norm(base - tips[twig], axis=1).max() < zone + 0.5 * size + 0.05


def test_leaves_hang_and_face_the_sky() -> None:
    def lowest(droop: float) -> tuple[float, float]:
        corners = leaves_of(leaf_droop=droop).vertices.reshape(-1, 4, 3)
        rib = corners[:, 2] - corners[:, 0]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        slope = rib[:, 2] / np.linalg.norm(rib, axis=1)
        return float(slope.mean()), float((normal[:, 2] > 0).mean())

    (stiff, _), (usual, up), (limp, _) = lowest(0.0), lowest(0.35), lowest(1.0)
    assert stiff > usual > limp
    assert limp == pytest.approx(-1)
    assert up > 0.85


def test_leaves_have_their_size() -> None:
    corners = leaves_of(leaf_size_m=0.2).vertices.reshape(-1, 4, 3)
    long = np.linalg.norm(corners[:, 2] - corners[:, 0], axis=1)
    wide = np.linalg.norm(corners[:, 1] - corners[:, 3], axis=1)
    assert 0.7 * 0.2 <= long.min() < long.max() <= 1.15 * 0.2
    assert wide == pytest.approx(0.62 * long)


def test_leaves_stand_around_an_upright_twig() -> None:
    """By the golden turn: no side of the twig is bare."""
    twig = axis_of([[0, 0, 0], [0, 0, 1]], 0.005)
    mesh = build(twig, options=MeshOptions(leaves="quads", leaves_per_tip=20))
    base = mesh.only(mesh.leaf).vertices.reshape(-1, 4, 3)[1:, 0]
    turn = np.sort(np.arctan2(base[:, 1], base[:, 0]))
    gaps = np.diff(turn, append=turn[0] + 2 * np.pi)
    assert np.degrees(gaps.max()) < 60
    assert base[:, 2].min() > 0.5


def test_a_stump_has_no_leaves() -> None:
    none = build(tree_of([[0, 0, 0]], [-1], [0.1]), options=MeshOptions(leaves="crosses"))
    assert len(none.faces) == 0


def test_nonsense_is_refused() -> None:
    with pytest.raises(ValidationError, match="quads"):
        MeshOptions.model_validate({"leaves": "needles"})
    with pytest.raises(ValidationError, match="less than or equal to 3"):
        MeshOptions(lod=4)
