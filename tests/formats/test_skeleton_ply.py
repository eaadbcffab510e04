"""Skeletons as PLY: exact round trips, other programs' files, and broken ones."""

from __future__ import annotations

import contextlib
import warnings
from pathlib import Path

import numpy as np
import plyfile
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.errors import InputFormatError, InputMissingError, OutputError
from pipeline.formats import skeleton_ply
from pipeline.formats.ply import open_ply
from pipeline.model import PROPAGATED, Skeleton, TreeModel

HEAD = [
    "ply",
    "format ascii 1.0",
    "element vertex 4",
    "property float x",
    "property float y",
    "property float z",
]
EDGE = ["element edge 3", "property int vertex1", "property int vertex2", "end_header"]
NODES = ["0 0 0", "0 0 1", "0 0 3", "1 0 1"]
ROWS = [*NODES, "0 1", "1 2", "1 3"]
TOP = HEAD[:2]


def put(path: Path, *lines: str) -> Path:
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.parametrize("ascii", [False, True])
def test_a_tree_comes_back_whole(tree: TreeModel, tmp_path: Path, ascii: bool) -> None:
    path = tmp_path / "t.skeleton.ply"
    skeleton_ply.write(tree, path, ascii=ascii)
    again = skeleton_ply.read(path)
    assert isinstance(again, TreeModel)
    assert np.array_equal(again.skeleton.parent, tree.skeleton.parent)
    assert np.array_equal(again.skeleton.origin, tree.skeleton.origin)
    assert np.abs(again.skeleton.xyz - tree.skeleton.xyz).max() < 1e-9
    assert np.array_equal(again.radius, tree.radius)
    assert np.array_equal(again.radius_source, tree.radius_source)
    assert np.array_equal(again.radius_rmse, tree.radius_rmse, equal_nan=True)
    assert again.trunk == tree.trunk
    assert again.skeleton.crs == "EPSG:28992"
    assert again.skeleton.metadata == tree.skeleton.metadata
    assert "source" not in again.metadata  # the same points give the same bytes, whatever their file
    assert again.metadata["flags"] == ("sparse",)
    assert again.metadata["dropped"] == {"voxel": 7}
    assert again.metadata["surface_mm"] == {"mean": 2.5, "p95": None}
    assert again.metadata["long"] == "x" * 700


def test_a_skeleton_comes_back_as_a_skeleton(tree: TreeModel, tmp_path: Path) -> None:
    skeleton_ply.write(tree.skeleton, tmp_path / "t.ply")
    again = skeleton_ply.read(tmp_path / "t.ply")
    assert isinstance(again, Skeleton)
    assert again.metadata == tree.skeleton.metadata
    assert np.array_equal(again.branch, tree.skeleton.branch)


def test_a_single_node_comes_back(tmp_path: Path) -> None:
    skeleton_ply.write(Skeleton(np.ones((1, 3)), np.array([-1])), tmp_path / "t.ply")
    assert skeleton_ply.read(tmp_path / "t.ply").xyz.tolist() == [[1, 1, 1]]  # type: ignore[union-attr]


def test_numbers_of_our_own_files_are_kept(tmp_path: Path) -> None:
    """The branch goes on with the shorter child, because the numbers say so."""
    skeleton = Skeleton(np.array([[0, 0, 0], [0, 0, 1], [0, 0, 1.1], [5, 0, 1.0]]), np.array([-1, 0, 1, 1]))
    skeleton_ply.write(skeleton, tmp_path / "t.ply")
    again = skeleton_ply.read(tmp_path / "t.ply")
    assert isinstance(again, Skeleton)
    assert again.xyz.tolist() == skeleton.xyz.tolist()
    assert again.branch.tolist() == [0, 0, 0, 1]


def test_coordinates_lie_on_the_cloud(tree: TreeModel, tmp_path: Path) -> None:
    skeleton_ply.write(tree, tmp_path / "t.ply")
    opened = plyfile.PlyData.read(tmp_path / "t.ply")
    assert np.array_equal(opened["vertex"]["x"], tree.skeleton.world[:, 0])
    assert opened["edge"]["vertex1"].tolist() == tree.skeleton.parent[1:].tolist()
    assert opened["edge"]["vertex2"].tolist() == [1, 2, 3, 4, 5]
    assert opened["vertex"]["radius_source"].dtype == np.uint8
    assert opened.comments[:3] == ["units m", "crs EPSG:28992", "offset 121913.4 487434.9 -0.3"]
    assert max(map(len, opened.comments)) < 240  # readers in use have lines of 256 characters


def test_trimesh_opens_it(tree: TreeModel, tmp_path: Path) -> None:
    skeleton_ply.write(tree, tmp_path / "t.ply")
    opened = trimesh.load(tmp_path / "t.ply")
    assert np.abs(np.asarray(opened.vertices) - tree.skeleton.world).max() < 1e-6  # type: ignore[union-attr]


def test_the_same_tree_gives_the_same_bytes(tree: TreeModel, tmp_path: Path) -> None:
    skeleton_ply.write(tree, tmp_path / "a.ply")
    skeleton_ply.write(tree, tmp_path / "b.ply")
    assert (tmp_path / "a.ply").read_bytes() == (tmp_path / "b.ply").read_bytes()


def test_other_programs_may_number_and_point_as_they_like(tmp_path: Path) -> None:
    edges = ["1 0", "1 2", "3 1"]  # the root is 3: no edge leads there
    path = put(tmp_path / "t.ply", *HEAD, *EDGE, "", *NODES, *edges)  # an empty line after the header
    read = skeleton_ply.read(path)
    assert isinstance(read, Skeleton)
    assert read.xyz.tolist() == [[1, 0, 1], [0, 0, 1], [0, 0, 3], [0, 0, 0]]
    assert read.parent.tolist() == [-1, 0, 1, 1]
    assert read.origin.tolist() == [0, 0, 0]
    assert read.crs is None


def test_radii_of_other_programs_are_not_said_to_be_measured(tmp_path: Path) -> None:
    head = [*HEAD, "property float radius"]
    nodes = [f"{xyz} 0.5" for xyz in NODES]
    read = skeleton_ply.read(put(tmp_path / "t.ply", *head, *EDGE, *nodes, "0 1", "1 2", "1 3"))
    assert isinstance(read, TreeModel)
    assert read.radius.tolist() == [0.5] * 4
    assert set(read.radius_source.tolist()) == {PROPAGATED}
    assert np.isnan(read.radius_rmse).all()


def test_national_coordinates_get_a_local_origin(tmp_path: Path) -> None:
    nodes = [f"{121913.25 + k} 487434.5 {k}.5" for k in range(4)]
    read = skeleton_ply.read(put(tmp_path / "t.ply", *HEAD, *EDGE, *nodes, "0 1", "1 2", "2 3"))
    assert isinstance(read, Skeleton)
    assert read.origin.tolist() == [121913, 487434, 0]
    assert read.xyz[0].tolist() == [0.25, 0.5, 0.5]


@pytest.mark.parametrize("order", ["<", ">"])
def test_binary_files_with_faces_before_the_edges(tmp_path: Path, order: str) -> None:
    vertex = np.array([(0, 0, 0), (0, 0, 1), (0, 0, 2)], dtype=[(a, "f4") for a in "xyz"])
    face = np.empty(2, dtype=[("vertex_indices", object)])
    face["vertex_indices"] = [np.array([0, 1, 2], dtype="i4"), np.array([0, 1], dtype="i4")]
    edge = np.array([(0, 1), (1, 2)], dtype=[("vertex1", "u4"), ("vertex2", "u4")])
    tables = [
        plyfile.PlyElement.describe(table, name)
        for table, name in ((vertex, "vertex"), (face, "face"), (edge, "edge"))
    ]
    for text in (False, True):
        plyfile.PlyData(tables, text=text, byte_order="=" if text else order).write(tmp_path / "t.ply")
        assert skeleton_ply.read(tmp_path / "t.ply").parent.tolist() == [-1, 0, 1]  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("lines", "says"),
    [
        (["hello"], "is not a PLY file"),
        (["ply", "format ascii 1.0"], "is not a PLY file"),
        (["ply", "format ebcdic 1.0", "end_header"], "format ebcdic"),
        (["ply", "element vertex 0", "end_header"], "names no format"),
        ([*HEAD, "end_header", *NODES], "has no edges, it is a cloud or a mesh"),
        ([*HEAD, *EDGE, *NODES, "0 1", "1 2"], "ends within its 3 rows of edge"),
        ([*HEAD, *EDGE, *NODES, "0 1", "1 2", "2 x"], "not a number"),
        ([*HEAD, *EDGE, *NODES, "0 1", "1 2", "2 0"], "not connected"),
        ([*HEAD, *EDGE[:1], *EDGE[1:], *NODES, "0 1", "1 2", "1 7"], "nodes run from 0 to 3"),
        ([*HEAD, "element edge 4", *EDGE[1:], *NODES, "0 1", "1 2", "2 3", "3 0"], "cycle"),
        ([*HEAD, "element edge 0", *EDGE[1:], *NODES], "two nodes and an edge"),
        ([*HEAD, *EDGE, "nan 0 0", *NODES[1:], "0 1", "1 2", "1 3"], "node 0 .* not finite"),
        ([*HEAD, "element edge 999999999999", *EDGE[1:], *NODES], "promises 999999999999 rows of edge"),
        ([*HEAD, "element edge -1", *EDGE[1:], *NODES], "promises -1 rows"),
        ([*HEAD, "property text name", *EDGE, *NODES], "which means nothing"),
        ([*TOP, "comment offset 1 2", *HEAD[2:], *EDGE, *ROWS], "offset '1 2' is not three numbers"),
        ([*TOP, "comment treepipe {", *HEAD[2:], *EDGE, *ROWS], "damaged"),
        ([*HEAD[:5], *EDGE, "0 0", "0 1", "1 1", "1 2", "0 1", "1 2", "1 3"], "lacks z"),
        ([*HEAD, "property float radius", *EDGE, *(f"{n} -1" for n in NODES), *ROWS[4:]], "negative"),
    ],
)  # fmt: skip
def test_broken_files_are_named_with_their_remedy(tmp_path: Path, lines: list[str], says: str) -> None:
    path = put(tmp_path / "broken.ply", *lines)
    with pytest.raises(InputFormatError, match=rf"(?s)broken\.ply: .*({says})"):
        skeleton_ply.read(path)


def test_absent_files_and_folders_are_named(tree: TreeModel, tmp_path: Path) -> None:
    with pytest.raises(InputMissingError, match=r"no\.ply: there is no such file"):
        skeleton_ply.read(tmp_path / "no.ply")
    with pytest.raises(OutputError, match="is a directory"):
        skeleton_ply.write(tree, tmp_path)


@pytest.mark.parametrize(("name", "count"), [("LAS00_9", 4468), ("Lille_11", 12805), ("Lille_2", 19502)])
def test_the_files_of_2021_open(shared_data: Path, name: str, count: int) -> None:
    path = shared_data / "ls2021" / f"{name}_skeleton.ply"
    read = skeleton_ply.read(path)
    assert isinstance(read, Skeleton)
    assert len(read) == count
    for branch in read.paths:
        assert (np.diff(branch[1:]) == 1).all()
    text = path.read_text().split("end_header")[1].split()
    given = np.array(text[: 3 * count], dtype=float).reshape(-1, 3)
    assert np.abs(np.sort(read.world, axis=0) - np.sort(given, axis=0)).max() < 1e-9
    edges = np.array(text[3 * count :], dtype=int).reshape(-1, 2)
    length = np.linalg.norm(given[edges[:, 0]] - given[edges[:, 1]], axis=1).sum()
    assert read.length.sum() == pytest.approx(length)


def test_a_header_tells_what_kind_of_file_it_is(tree: TreeModel, tmp_path: Path) -> None:
    skeleton_ply.write(tree, tmp_path / "t.ply")
    ply = open_ply(tmp_path / "t.ply")
    assert ply.element("face") is None
    edge = ply.element("edge")
    assert edge is not None
    assert edge.count == 5


@settings(max_examples=50, deadline=None)
@given(draws=st.lists(st.integers(0, 50), max_size=30), wide=st.integers(1, 6), ascii=st.booleans())
def test_any_tree_comes_back(
    tmp_path_factory: pytest.TempPathFactory, draws: list[int], wide: int, ascii: bool
) -> None:
    generator = np.random.default_rng(len(draws))
    count = len(draws) + 1
    parent = np.array([-1] + [max(i - d % wide, 0) for i, d in enumerate(draws)])
    skeleton = Skeleton(generator.normal(0, 9, (count, 3)), parent, generator.uniform(-1e6, 1e6, 3))
    tree = TreeModel(
        skeleton, generator.random(count), generator.integers(0, 3, count), generator.random(count)
    )
    path = tmp_path_factory.mktemp("ply") / "t.ply"
    skeleton_ply.write(tree, path, ascii=ascii)
    again = skeleton_ply.read(path)
    assert isinstance(again, TreeModel)
    assert np.array_equal(again.skeleton.parent, parent)
    assert np.abs(again.skeleton.xyz - skeleton.xyz).max() < 1e-9
    assert np.array_equal(again.radius, tree.radius)


@settings(max_examples=100, deadline=None)
@given(st.binary(max_size=80), st.integers(0, 400))
def test_damaged_bytes_give_an_error_or_a_tree(
    tmp_path_factory: pytest.TempPathFactory, junk: bytes, place: int
) -> None:
    skeleton = Skeleton(np.arange(12, dtype=float).reshape(4, 3), np.array([-1, 0, 1, 1]))
    path = tmp_path_factory.mktemp("ply") / "t.ply"
    skeleton_ply.write(skeleton, path)
    whole = bytearray(path.read_bytes())
    whole[place : place + len(junk)] = junk
    path.write_bytes(bytes(whole))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # wild numbers overflow on their way
        with contextlib.suppress(InputFormatError):
            skeleton_ply.read(path)
