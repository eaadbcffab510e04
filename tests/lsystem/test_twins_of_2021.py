"""The skeletons of the 2021 report: their files are read, ours are exact and no larger."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from pipeline.lsystem import LsystemOptions, decode, encode, max_error, read_lsjson, write_lsjson
from pipeline.model import Skeleton, TreeModel

TWINS = ("Lille_2", "Lille_11", "LAS00_9")


def read_twin(path: Path) -> TreeModel:
    """Read an ASCII PLY of 2021, empty line and all, as a tree that stands on its lowest node."""
    header, body = path.read_text(encoding="ascii").split("end_header", 1)
    count = int(header.split("element vertex ")[1].split()[0])
    rows = [line.split() for line in body.splitlines() if line.strip()]
    xyz, edges = np.array(rows[:count], dtype=float), np.array(rows[count:], dtype=int)
    near: list[list[int]] = [[] for _ in range(count)]
    for a, b in edges.tolist():
        near[a].append(b)
        near[b].append(a)
    root = int(xyz[:, 2].argmin())
    order, parent, new = [root], [-1], {root: 0}
    for i in order:  # grows while it is walked
        for j in near[i]:
            if j not in new:
                new[j] = len(order)
                order.append(j)
                parent.append(new[i])
    world = xyz[order]
    skeleton = Skeleton(world - world[0], np.array(parent), world[0].copy())
    return TreeModel(skeleton, np.zeros(count), np.ones(count, dtype=np.uint8), np.full(count, np.nan))


@pytest.mark.parametrize("name", TWINS)
def test_twins(name: str, shared_data: Path, tmp_path: Path) -> None:
    tree = read_twin(shared_data / "ls2021" / f"{name}_skeleton.ply")
    theirs = shared_data / "ls2021" / f"{name}_lsystem.json"
    for options in (LsystemOptions(), LsystemOptions(angle_decimals=3)):
        document = encode(tree, options=options)
        assert max_error(tree, document) <= 0.0006
        back = decode(document)
        assert np.linalg.norm(back.skeleton.world[0] - tree.skeleton.world[0]) <= 0.0001
        assert encode(back, options=options) == document
        write_lsjson(document, tmp_path / "ours.ls.json")
        assert (tmp_path / "ours.ls.json").stat().st_size <= theirs.stat().st_size


@pytest.mark.parametrize("name", TWINS)
def test_their_files_are_read(name: str, shared_data: Path) -> None:
    ours = read_twin(shared_data / "ls2021" / f"{name}_skeleton.ply").skeleton
    theirs = decode(read_lsjson(shared_data / "ls2021" / f"{name}_lsystem.json")).skeleton
    assert len(theirs) == len(ours)
    assert len(theirs.tips) == len(ours.tips)
    assert float(theirs.length.sum()) == pytest.approx(float(ours.length.sum()), rel=1e-3)
    offset = theirs.xyz - ours.xyz[cKDTree(ours.xyz).query(theirs.xyz)[1]]
    offset = offset - offset.mean(axis=0)
    assert np.linalg.norm(offset, axis=1).max() < 0.017  # what their open loop left behind


@pytest.mark.parametrize(
    "name", ["in_a", "Lille_2_lsystem_gen", *(f"tree1_lsystem_gen_{n}" for n in (1, 2, 3))]
)
def test_files_with_rules_are_read_and_written_without(name: str, shared_data: Path) -> None:
    tree = decode(read_lsjson(shared_data / "ls2021" / f"{name}.json"))
    assert len(tree) > 3_000
    assert max_error(tree, encode(tree)) <= 0.0006
