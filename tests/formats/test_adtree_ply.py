"""AdTree's skeletons: paths that share places become one tree; broken files; its models of real trees."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
import plyfile
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.formats import adtree_ply
from pipeline.model import Skeleton, TreeModel
from tests.formats.exchanged import assert_named, damaged, junk, scored

NODES = [[0, 0, 0], [0, 0, 1], [0, 0, 3], [0, 0, 1], [1, 0, 1]]
RADII = [0.3, 0.2, 0.1, 0.05, 0.04]
EDGES = [[0, 1], [1, 2], [3, 4]]

TEXT = """\
ply
format ascii 1.0
element vertex 5
property float x
property float y
property float z
property float radius
element edge 3
property list uchar int vertex_indices
end_header
0 0 0 .3
0 0 1 .2
0 0 3 .1
0 0 1 .05
1 0 1 .04
2 0 1
2 1 2
2 3 4
"""


def save(path: Path, nodes: object, radii: object, edges: object, *, text: bool = False) -> Path:
    """Write what AdTree writes: single precision, edges as lists of two."""
    places = np.asarray(nodes)
    vertex = np.empty(len(places), dtype=[(name, "f4") for name in ("x", "y", "z", "radius")])
    for k, name in enumerate("xyz"):
        vertex[name] = places[:, k]
    vertex["radius"] = radii
    edge = np.empty(len(np.asarray(edges)), dtype=[("vertex_indices", "i4", (2,))])
    edge["vertex_indices"] = edges
    tables = [
        plyfile.PlyElement.describe(vertex, "vertex"),
        plyfile.PlyElement.describe(edge, "edge", len_types={"vertex_indices": "u4"}),
    ]
    plyfile.PlyData(tables, text=text).write(path)
    return path


@pytest.mark.parametrize("text", [False, True])
def test_paths_that_share_a_place_are_one_tree(tmp_path: Path, text: bool) -> None:
    tree = adtree_ply.read(save(tmp_path / "t_skeleton.ply", NODES, RADII, EDGES, text=text))
    assert isinstance(tree, TreeModel)
    assert tree.skeleton.world.tolist() == [[0, 0, 0], [0, 0, 1], [0, 0, 3], [1, 0, 1]]
    assert tree.skeleton.parent.tolist() == [-1, 0, 1, 1]
    assert tree.radius.tolist() == pytest.approx([0.3, 0.2, 0.1, 0.04])


def test_without_radii_it_is_a_skeleton(tmp_path: Path) -> None:
    rows = [line.rsplit(" ", 1)[0] if line.count(" ") == 3 else line for line in TEXT.splitlines()]
    (tmp_path / "t.ply").write_text("\n".join(rows).replace("property float radius\n", ""))
    read = adtree_ply.read(tmp_path / "t.ply")
    assert isinstance(read, Skeleton)
    assert read.parent.tolist() == [-1, 0, 1, 1]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", r"is empty \(0 bytes\)"),
        (TEXT[: TEXT.index("element edge")] + "end_header\n" + "0 0 0 1\n" * 5, "has no edges"),
        (TEXT.replace("property float z\n", ""), "has no nodes with x, y and z"),
        (TEXT.replace("2 3 4", "2 3 9"), "edge 2 names a node that is not there"),
        (TEXT.replace("2 3 4", "3 3 4"), "edge 2 does not join two nodes"),
        (TEXT.replace("2 3 4", "2 3 x"), "ends within its 3 edges"),
        (TEXT.replace("2 3 4\n", ""), "ends within its 3 edges"),
        (TEXT.replace("0 0 1 .05", "0 9 1 .05"), "not connected"),
        (TEXT.replace("2 3 4", "2 0 2"), "not connected|cycle"),
        (TEXT.replace("1 0 1 .04", "nan 0 1 .04"), "node 4 has a coordinate that is not finite"),
        (TEXT.replace("1 0 1 .04", "1 0 1 -1"), "node 4 has a negative radius"),
        (TEXT.replace("list uchar int", "list uchar float"), "other than a list of two"),
    ],
)
def test_broken_files_are_named_with_their_remedy(tmp_path: Path, text: str, says: str) -> None:
    assert_named(adtree_ply.read, tmp_path / "t.ply", text, says)


@settings(max_examples=100)
@given(junk=junk, place=st.integers(0, 400))
def test_damage_gives_an_error_or_a_tree(
    tmp_path_factory: pytest.TempPathFactory, junk: bytes, place: int
) -> None:
    path = save(tmp_path_factory.mktemp("adtree") / "t.ply", NODES, RADII, EDGES)
    damaged(adtree_ply.read, path, junk, place)


@pytest.mark.parametrize("name", ["tree1", "ahn_LAS00_9"])
def test_its_models_of_real_trees(shared_data: Path, tmp_path: Path, name: str) -> None:
    """Its edges, each with nodes of its own as it saves them, make one tree on the cloud."""
    with gzip.open(shared_data / "adtree" / f"{name}.edges.txt.gz", "rt") as file:
        table = np.loadtxt(file)
    centre = np.floor(table[0, :3])  # single precision needs a near zero, as AdTree has it
    nodes = (table[:, :6].reshape(-1, 3) - centre).round(4)
    edges = np.arange(len(nodes)).reshape(-1, 2)
    path = save(tmp_path / "t.ply", nodes, np.repeat(table[:, 6], 2), edges)
    read = adtree_ply.read(path)
    assert isinstance(read, TreeModel)
    assert len(read) <= len(table) + 1
    assert read.skeleton.length.sum() == pytest.approx(
        np.linalg.norm(table[:, 3:6] - table[:, :3], axis=1).sum(), rel=0.01
    )
    moved = Skeleton(read.skeleton.xyz, read.skeleton.parent, read.skeleton.origin + centre)
    tree = TreeModel(moved, read.radius, read.radius_source, read.radius_rmse)
    told = scored(tree, shared_data / "trees" / f"{name}.xyz", tmp_path)
    assert told["surface_median_mm"] < 60
