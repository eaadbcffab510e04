"""TreeQSM's models from MATLAB: written here by scipy and h5py, broken ones, and two real ones."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.io import savemat

from pipeline.errors import InputFormatError, InputMissingError, MissingExtraError
from pipeline.formats import treeqsm_mat
from tests.formats.exchanged import assert_named, damaged, junk, scored


def cylinder() -> dict[str, Any]:
    """A stem of two cylinders and a branch on the first."""
    return {
        "radius": np.array([[0.2], [0.1], [0.05]], dtype=np.float32),
        "length": np.array([[1.0], [1.0], [1.0]]),
        "start": np.array([[0, 0, 0], [0, 0, 1], [0.2, 0, 0.5]]),
        "axis": np.array([[0, 0, 1], [0, 0, 1], [1, 0, 0]], dtype=np.float64),
        "parent": np.array([[0], [1], [1]], dtype=np.uint16),
        "branch": np.array([[1], [1], [2]], dtype=np.uint8),
    }


def save(path: Path, held: Any, name: str = "QSM") -> Path:
    savemat(path, {name: {"cylinder": held, "treedata": {"TotalVolume": 3.0}}})
    return path


@pytest.mark.parametrize("name", ["QSM", "OptQSM", "anything"])
def test_a_model_is_found_under_any_name(tmp_path: Path, name: str) -> None:
    tree = treeqsm_mat.read(save(tmp_path / "t.mat", cylinder(), name))
    assert tree.skeleton.world[0].tolist() == [0, 0, 0]
    assert tree.skeleton.world[-1].tolist() == [1.2, 0, 0.5]
    assert tree.skeleton.order.max() == 1
    assert tree.radius[0] == pytest.approx(0.2)


def test_a_single_cylinder(tmp_path: Path) -> None:
    one = {name: values[:1] for name, values in cylinder().items()}
    assert treeqsm_mat.read(save(tmp_path / "t.mat", one)).skeleton.parent.tolist() == [-1, 0]


def changed(**values: Any) -> dict[str, Any]:
    return {key: value for key, value in {**cylinder(), **values}.items() if value is not None}


@pytest.mark.parametrize(
    ("held", "says"),
    [
        (changed(axis=None), "holds no structure with a cylinder"),
        (changed(start=None), "its cylinder lacks start"),
        (changed(parent=np.array([0, 1, 9])), "row 3 of its cylinder names the parent 9"),
        (changed(parent=np.array([0, 0, 1])), "row 2 of its cylinder has no parent"),
        (changed(parent=np.array([0, 3, 2])), "row 2 of its cylinder is its own ancestor"),
        (changed(length=np.array([1, np.nan, 1])), "cylinder.length is not finite in row 2"),
        (changed(length=np.array([1, 1])), "cylinder.length is no array of shape"),
        (changed(radius=np.array([1, -1, 1])), "row 2 of its cylinder has the radius -1"),
    ],
)
def test_broken_models_are_named_with_row_and_remedy(tmp_path: Path, held: Any, says: str) -> None:
    path = save(tmp_path / "t.mat", held)
    assert_named(treeqsm_mat.read, path, path.read_bytes(), says)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"", "is no .mat file"),
        (b"hello", "is no .mat file"),
        (b"\x89HDF\r\n\x1a\n" + bytes(100), "is a damaged .mat file"),
    ],
)
def test_other_files_are_named(tmp_path: Path, content: bytes, says: str) -> None:
    assert_named(treeqsm_mat.read, tmp_path / "t.mat", content, says)


def test_absent_files_and_several_models_are_named(tmp_path: Path) -> None:
    with pytest.raises(InputMissingError, match="no such file"):
        treeqsm_mat.read(tmp_path / "no.mat")
    models = np.array([{"cylinder": cylinder()}, {"cylinder": cylinder()}], dtype=object)
    savemat(tmp_path / "t.mat", {"QSM": models})
    with pytest.raises(InputFormatError, match="holds 2 models; save one"):
        treeqsm_mat.read(tmp_path / "t.mat")


def save_hdf5(path: Path) -> Path:
    """Write what MATLAB 7.3 writes: 512 bytes of its own, then HDF5 with transposed arrays."""
    h5py = pytest.importorskip("h5py", reason="version 7.3 needs the extra matlab")
    with h5py.File(path, "w", userblock_size=512) as file:
        group = file.create_group("QSM/cylinder")
        for name, values in cylinder().items():
            group[name] = np.asarray(values).T
    return path


def test_a_model_of_version_7_3(tmp_path: Path) -> None:
    plain = treeqsm_mat.read(save(tmp_path / "a.mat", cylinder()))
    other = treeqsm_mat.read(save_hdf5(tmp_path / "b.mat"))
    assert other.skeleton.world.tolist() == plain.skeleton.world.tolist()
    assert other.radius.tolist() == plain.radius.tolist()


def test_the_extra_is_named_where_it_is_absent(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "t.mat").write_bytes(b"\x89HDF\r\n\x1a\n")
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(MissingExtraError, match=r"t\.mat: .*pip install 'treepipe\[matlab\]'"):
        treeqsm_mat.read(tmp_path / "t.mat")


@settings(max_examples=100)
@given(junk=junk, place=st.integers(0, 2000))
def test_damage_gives_an_error_or_a_tree(
    tmp_path_factory: pytest.TempPathFactory, junk: bytes, place: int
) -> None:
    path = save(tmp_path_factory.mktemp("mat") / "t.mat", cylinder())
    damaged(treeqsm_mat.read, path, junk, place)


@pytest.mark.parametrize(
    ("name", "cloud", "litres", "dbh_cm", "branches"),
    [
        ("rtwig_coffeetree", "rtwig_coffeetree.txt", 21.57, 7.35, 82),
        ("itsme_tree1", "itsme_tree1.las", 263.7, 15.35, 2),
    ],
)
def test_models_of_treeqsm(
    shared_data: Path, tmp_path: Path, name: str, cloud: str, litres: float, dbh_cm: float, branches: int
) -> None:
    """The figures that TreeQSM gives for them."""
    tree = treeqsm_mat.read(shared_data / "trees" / f"{name}.treeqsm.mat")
    assert len(tree.skeleton.paths) == branches
    assert 1000 * tree.volume.sum() == pytest.approx(litres, rel=0.03)
    told = scored(tree, shared_data / "trees" / cloud, tmp_path)
    assert told["dbh_cm"] == pytest.approx(dbh_cm, rel=0.03)
