"""Meshes as OBJ, as other programs read them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
import vtk
from PIL import Image
from vtk.util.numpy_support import vtk_to_numpy

from pipeline.errors import OutputError
from pipeline.formats import obj
from pipeline.formats.png import packed
from pipeline.mesh import Mesh, MeshOptions, build, tubes
from pipeline.mesh.look import Look
from pipeline.model import TreeModel

LEAFY = MeshOptions(leaves="quads", smooth=True)


def read(path: Path) -> dict[str, list[list[str]]]:
    """Return the words behind every keyword."""
    lines: dict[str, list[list[str]]] = {}
    for line in filter(None, path.read_text().splitlines()):
        key, *rest = line.split()
        lines.setdefault(key, []).append(rest)
    return lines


def test_trimesh_reads_the_same_triangles(tree: TreeModel, tmp_path: Path) -> None:
    mesh = build(tree, options=LEAFY)
    obj.write(mesh, tmp_path / "t.obj")
    scene = trimesh.load_scene(tmp_path / "t.obj", process=False)
    assert set(scene.geometry) == {"bark", "leaf"}
    bark, leaf = scene.geometry["bark"], scene.geometry["leaf"]
    assert bark.is_watertight
    assert bark.volume == pytest.approx(mesh.branch_volume.sum(), rel=1e-4)
    assert len(bark.faces) == (~mesh.leaf).sum()
    assert len(leaf.faces) == mesh.leaf.sum()
    assert scene.bounds == pytest.approx(
        np.array([mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)]), abs=1e-6
    )
    assert bark.visual.material.diffuse[:3].tolist() == [112, 84, 61]
    assert leaf.visual.material.diffuse[1] > leaf.visual.material.diffuse[0]


def test_vtk_reads_the_same_triangles(tree: TreeModel, tmp_path: Path) -> None:
    mesh = tubes(tree)
    obj.write(mesh, tmp_path / "t.obj")
    reader = vtk.vtkOBJReader()
    reader.SetFileName(str(tmp_path / "t.obj"))
    reader.Update()
    seen = reader.GetOutput()
    assert vtk_to_numpy(seen.GetPoints().GetData()) == pytest.approx(mesh.vertices, abs=1e-5)
    corners = vtk_to_numpy(seen.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    assert np.array_equal(corners, mesh.faces)


def test_every_branch_is_a_group(tree: TreeModel, tmp_path: Path) -> None:
    mesh = build(tree, options=LEAFY)
    obj.write(mesh, tmp_path / "t.obj")
    lines = read(tmp_path / "t.obj")
    assert lines["g"] == [["branch_0"], ["branch_1"], ["branch_2"], ["leaves"]]
    assert lines["o"] == [["bark"], ["leaves"]]
    assert lines["usemtl"] == [["bark"], ["leaf"]]
    assert len(lines["vn"]) == len(lines["v"]) == len(mesh.vertices)
    assert all(a == b for corner in lines["f"] for a, b in [entry.split("//") for entry in corner])
    flat = tubes(tree)
    obj.write(flat, tmp_path / "flat.obj")
    assert "vn" not in read(tmp_path / "flat.obj")


def test_coordinates_are_local_and_the_origin_is_said(tree: TreeModel, tmp_path: Path) -> None:
    mesh = tubes(tree)
    obj.write(mesh, tmp_path / "t.obj")
    text = (tmp_path / "t.obj").read_text()
    assert "# origin 121913.4 487434.9 -0.3 EPSG:28992\n" in text
    points = np.array(read(tmp_path / "t.obj")["v"], dtype=float)
    assert points == pytest.approx(mesh.vertices, abs=1e-6)
    obj.write(mesh, tmp_path / "w.obj", world=True)
    whole = read(tmp_path / "w.obj")
    assert np.array(whole["v"], dtype=float) == pytest.approx(mesh.world, abs=1e-6)
    assert ["origin", "0.0", "0.0", "0.0", "EPSG:28992"] in whole["#"]


def test_a_far_zero_is_moved_near(tree: TreeModel, tmp_path: Path) -> None:
    mesh = tubes(tree)
    far = Mesh(mesh.world, mesh.faces, mesh.branch, np.zeros(3), mesh.crs)
    obj.write(far, tmp_path / "t.obj")
    lines = read(tmp_path / "t.obj")
    points = np.array(lines["v"], dtype=float)
    origin = np.array(next(line for line in lines["#"] if line[0] == "origin")[1:4], dtype=float)
    assert np.abs(points).max() < 10
    assert np.array_equal(origin, np.floor(mesh.world.min(axis=0)))
    assert points + origin == pytest.approx(mesh.world, abs=2e-6)


def test_the_materials_lie_beside(tree: TreeModel, tmp_path: Path) -> None:
    obj.write(tubes(tree), tmp_path / "oude eik.obj")
    (library,) = read(tmp_path / "oude eik.obj")["mtllib"]
    assert library == ["oude_eik.mtl"]
    assert [name for (name,) in read(tmp_path / "oude_eik.mtl")["newmtl"]] == ["bark", "leaf"]


def test_the_same_tree_gives_the_same_bytes(tree: TreeModel, tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        obj.write(build(tree, options=LEAFY), tmp_path / name / "t.obj")
    for file in ("t.obj", "t.mtl"):
        assert (tmp_path / "a" / file).read_bytes() == (tmp_path / "b" / file).read_bytes()
    assert "-0.000000" not in (tmp_path / "a" / "t.obj").read_text()


def test_a_name_that_would_break_the_comment_is_left_out(tree: TreeModel, tmp_path: Path) -> None:
    mesh = tubes(tree)
    odd = Mesh(mesh.vertices, mesh.faces, mesh.branch, mesh.origin, "local\nf 1 1 1")
    obj.write(odd, tmp_path / "t.obj")
    assert len(read(tmp_path / "t.obj")["f"]) == len(mesh.faces)


def test_an_empty_mesh_is_a_file(tmp_path: Path) -> None:
    none = np.zeros((0, 3))
    obj.write(Mesh(none, none, none[:, 0]), tmp_path / "t.obj")
    assert set(read(tmp_path / "t.obj")) == {"#", "mtllib"}


def test_a_folder_in_the_way_is_named(tree: TreeModel, tmp_path: Path) -> None:
    (tmp_path / "t.obj").mkdir()
    with pytest.raises(OutputError, match=r"t\.obj: is a directory"):
        obj.write(tubes(tree), tmp_path / "t.obj")


def test_corners_have_places_in_pictures_and_no_seam_smears(tree: TreeModel, tmp_path: Path) -> None:
    mesh = tubes(tree, tile_m=0.5)
    assert mesh.uv is not None
    look = Look(bark_png=packed(np.full((4, 4, 3), 99, dtype=np.uint8)))
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        obj.write(mesh, tmp_path / name / "t.obj", look=look)
    for file in ("t.obj", "t.mtl", "t_bark.png"):
        assert (tmp_path / "a" / file).read_bytes() == (tmp_path / "b" / file).read_bytes()
    lines = read(tmp_path / "a" / "t.obj")
    places = np.array(lines["vt"], dtype=float)
    used = np.array([[corner.split("/")[1] for corner in face] for face in lines["f"]], dtype=int) - 1
    assert places[used] == pytest.approx(mesh.uv, abs=1e-5)
    around = np.ptp(mesh.uv[:, :, 0], axis=1)
    for branch in range(3):
        sides = mesh.branch == branch
        pictures = max(1, np.round(mesh.uv[sides, :, 0].max()))
        assert around[sides].max() <= pictures / 3 + 1e-9  # at most one side of a triangle
    u, v = mesh.uv[:, 1] - mesh.uv[:, 0], mesh.uv[:, 2] - mesh.uv[:, 0]
    assert np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]).min() > 0
    for (name,) in read(tmp_path / "a" / "t.mtl")["map_Kd"]:
        assert Image.open(tmp_path / "a" / name).getpixel((0, 0)) == (99, 99, 99)
