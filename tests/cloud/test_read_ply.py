"""PLY and PCD clouds, ascii and binary."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from plyfile import PlyData, PlyElement
from pypcd4.pypcd4 import Encoding
from pypcd4.pypcd4 import PointCloud as Pcd

from pipeline.cloud import read_cloud
from pipeline.errors import InputFormatError

WORLD = np.array([[120000.123, 487000.456, 1.789], [120001.001, 487002.002, 3.003], [120002, 487001, 2]])
HEADER = "ply\nformat ascii 1.0\nelement vertex 2\nproperty double x\nproperty double y\nproperty double z\n"


def vertices() -> PlyElement:
    rows = np.zeros(len(WORLD), [("nx", "f4"), ("x", "f8"), ("y", "f8"), ("z", "f8"), ("red", "u1")])
    rows["x"], rows["y"], rows["z"] = WORLD.T
    return PlyElement.describe(rows, "vertex")


@pytest.mark.parametrize(("text", "order"), [(True, "="), (False, "<"), (False, ">")])
def test_ply_keeps_millimetres(tmp_path: Path, text: bool, order: str) -> None:
    file = tmp_path / "tree.ply"
    PlyData([vertices()], text=text, byte_order=order).write(str(file))
    cloud = read_cloud(file)
    np.testing.assert_allclose(cloud.world, WORLD, rtol=0, atol=1e-9)
    assert cloud.origin.tolist() == [120000, 487000, 1]


@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize("gap", ["", "\n", "\n \n"])
def test_ply_with_empty_lines(tmp_path: Path, end: str, gap: str) -> None:
    file = tmp_path / "tree.ply"
    text = f"{HEADER}end_header\n{gap}1 2 3\n{gap}4 5 6\n{gap}"
    file.write_bytes(text.replace("\n", end).encode())
    assert read_cloud(file).world.tolist() == [[1, 2, 3], [4, 5, 6]]


@pytest.mark.parametrize(
    ("more", "says"),
    [
        (("edge", [("vertex1", "i4"), ("vertex2", "i4")]), "is a skeleton .* use the cloud"),
        (("face", [("vertex_indices", "i4", (3,))]), "is a mesh .* export its vertices"),
    ],
)
def test_a_model_is_no_cloud(tmp_path: Path, more: tuple[str, list[tuple[str, str]]], says: str) -> None:
    file = tmp_path / "tree.ply"
    PlyData([vertices(), PlyElement.describe(np.zeros(1, more[1]), more[0])]).write(str(file))
    with pytest.raises(InputFormatError, match=says):
        read_cloud(file)


def test_ply_with_no_faces_is_a_cloud(tmp_path: Path) -> None:
    file = tmp_path / "tree.ply"
    faces = "element face 0\nproperty list uchar int vertex_indices\n"
    file.write_text(f"{HEADER}{faces}end_header\n1 2 3\n4 5 6\n")
    assert len(read_cloud(file)) == 2


@pytest.mark.parametrize("text", [True, False])
def test_ply_that_breaks_off(tmp_path: Path, text: bool) -> None:
    file = tmp_path / "tree.ply"
    PlyData([vertices()], text=text).write(str(file))
    whole = file.read_bytes()
    for length in (2, 60, len(whole) - 12 * (1 + text)):
        file.write_bytes(whole[:length])
        with pytest.raises(InputFormatError, match=r"tree\.ply: cannot be read .* export it again"):
            read_cloud(file)


def test_ply_without_coordinates(tmp_path: Path) -> None:
    file = tmp_path / "tree.ply"
    file.write_text(HEADER.replace("double z", "double height") + "end_header\n1 2 3\n4 5 6\n")
    with pytest.raises(InputFormatError, match="no vertex properties x, y and z; rename"):
        read_cloud(file)


def test_ply_without_points(tmp_path: Path) -> None:
    file = tmp_path / "tree.ply"
    file.write_text(HEADER.replace("vertex 2", "vertex 0") + "end_header\n")
    with pytest.raises(InputFormatError, match="holds no points"):
        read_cloud(file)


def pcd(file: Path, encoding: Encoding, fields: tuple[str, ...] = ("x", "y", "z", "intensity")) -> Path:
    table = np.column_stack([WORLD, [1, 2, 3]])
    Pcd.from_points(table, fields, (np.float64,) * 4).save(file, encoding=encoding)
    return file


@pytest.mark.parametrize("encoding", list(Encoding))
def test_pcd_keeps_millimetres(tmp_path: Path, encoding: Encoding) -> None:
    cloud = read_cloud(pcd(tmp_path / "tree.pcd", encoding))
    np.testing.assert_allclose(cloud.world, WORLD, rtol=0, atol=1e-9)


@pytest.mark.parametrize("encoding", list(Encoding))
@pytest.mark.parametrize("kept", [0.05, 0.5, 0.85])
def test_pcd_that_breaks_off(tmp_path: Path, encoding: Encoding, kept: float) -> None:
    file = pcd(tmp_path / "tree.pcd", encoding)
    whole = file.read_bytes()
    file.write_bytes(whole[: int(len(whole) * kept)])
    with pytest.raises(InputFormatError, match=r"tree\.pcd: .*export it again"):
        read_cloud(file)


def test_pcd_without_coordinates(tmp_path: Path) -> None:
    file = pcd(tmp_path / "tree.pcd", Encoding.BINARY, ("x", "y", "height", "intensity"))
    with pytest.raises(InputFormatError, match="no x, y and z fields"):
        read_cloud(file)
