"""Meshes as PLY, as other programs read them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import plyfile
import pytest
import trimesh

from pipeline.formats import mesh_ply
from pipeline.formats.ply import open_ply
from pipeline.mesh import Mesh, MeshOptions, build, tubes
from pipeline.model import Skeleton, TreeModel


def test_other_programs_read_the_same_triangles(tree: TreeModel, tmp_path: Path) -> None:
    mesh = tubes(tree)
    mesh_ply.write(mesh, tmp_path / "t.mesh.ply")
    opened = plyfile.PlyData.read(tmp_path / "t.mesh.ply")
    assert np.array_equal(np.vstack(opened["face"]["vertex_indices"]), mesh.faces)
    assert np.array_equal(opened["face"]["branch"], mesh.branch)
    assert np.array_equal(opened["vertex"]["y"], mesh.world[:, 1])
    assert "crs EPSG:28992" in opened.comments
    surface = trimesh.load(tmp_path / "t.mesh.ply", process=False)
    assert isinstance(surface, trimesh.Trimesh)
    assert surface.is_watertight
    moved = surface.copy()
    moved.apply_translation(-tree.skeleton.origin)
    assert moved.volume == pytest.approx(mesh.branch_volume.sum(), rel=1e-6)


def test_our_reader_finds_the_columns(tree: TreeModel, tmp_path: Path) -> None:
    mesh_ply.write(tubes(tree), tmp_path / "t.ply")
    ply = open_ply(tmp_path / "t.ply")
    face = ply.element("face")
    assert face is not None
    assert face.has_lists
    assert len(ply.columns("vertex")["x"]) == len(tubes(tree).vertices)


def test_an_empty_mesh_is_a_file(tmp_path: Path) -> None:
    stump = TreeModel(Skeleton(np.zeros((1, 3)), np.array([-1])), np.ones(1), np.zeros(1), np.ones(1))
    empty = tubes(stump)
    assert isinstance(empty, Mesh)
    mesh_ply.write(empty, tmp_path / "t.ply")
    assert plyfile.PlyData.read(tmp_path / "t.ply")["vertex"].count == 0


def test_leaves_are_told_from_bark(tree: TreeModel, tmp_path: Path) -> None:
    mesh = build(tree, options=MeshOptions(leaves="crosses"))
    mesh_ply.write(mesh, tmp_path / "t.ply")
    face = plyfile.PlyData.read(tmp_path / "t.ply")["face"]
    assert np.array_equal(face["leaf"], mesh.leaf)
    assert np.array_equal(face["branch"], mesh.branch)
    mesh_ply.write(tubes(tree), tmp_path / "bare.ply")
    assert b"leaf" not in (tmp_path / "bare.ply").read_bytes()
