"""Trees as archives: everything comes back, to the last bit and byte."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

from pipeline.errors import InputFormatError, InputMissingError, ModelError
from pipeline.formats import model_npz
from pipeline.formats.metadata import from_json, to_json
from pipeline.model import TreeModel


def test_everything_comes_back_to_the_last_bit(tree: TreeModel, tmp_path: Path) -> None:
    model_npz.write(tree, tmp_path / "t.npz")
    again = model_npz.read(tmp_path / "t.npz")
    for name in ("xyz", "parent", "origin"):
        assert np.array_equal(getattr(again.skeleton, name), getattr(tree.skeleton, name))
    for name in ("radius", "radius_source", "radius_rmse"):
        assert np.array_equal(getattr(again, name), getattr(tree, name), equal_nan=True)
    assert again.skeleton.crs == tree.skeleton.crs
    assert again.trunk == tree.trunk
    assert again.skeleton.metadata == tree.skeleton.metadata
    assert set(again.metadata) == set(tree.metadata)
    assert again.metadata["source"]["path"] == "eik é\n.laz"
    assert again.metadata["flags"] == ("sparse",)
    assert again.metadata["surface_mm"]["p95"] is None  # not finite is unknown


def test_the_same_tree_gives_the_same_bytes(
    tree: TreeModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    model_npz.write(tree, tmp_path / "a.npz")
    monkeypatch.setattr(time, "time", lambda: 2e9)
    model_npz.write(model_npz.read(tmp_path / "a.npz"), tmp_path / "b.npz")
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


def test_other_archives_are_named(tmp_path: Path) -> None:
    np.savez(tmp_path / "truth.npz", s=np.zeros((1, 3)), e=np.zeros((1, 3)), r=np.zeros(1))
    with pytest.raises(InputFormatError, match=r"truth\.npz: is a truth of cylinders, not a model"):
        model_npz.read(tmp_path / "truth.npz")
    np.savez(tmp_path / "x.npz", a=np.zeros(1))
    with pytest.raises(InputFormatError, match="another archive"):
        model_npz.read(tmp_path / "x.npz")
    np.save(tmp_path / "x.npy", np.zeros(1))
    with pytest.raises(InputFormatError, match="single array"):
        model_npz.read(tmp_path / "x.npy")
    np.savez(tmp_path / "evil.npz", json=np.array([{"a": 1}], dtype=object))
    with pytest.raises(InputFormatError, match=r"evil\.npz: is not an archive"):
        model_npz.read(tmp_path / "evil.npz")
    with pytest.raises(InputMissingError, match="no such file"):
        model_npz.read(tmp_path / "no.npz")


def test_damaged_archives_are_named(tree: TreeModel, tmp_path: Path) -> None:
    model_npz.write(tree, tmp_path / "t.npz")
    whole = (tmp_path / "t.npz").read_bytes()
    for content in (b"", b"nonsense", whole[: len(whole) // 2], whole[:100] + b"\0" * 40 + whole[140:]):
        (tmp_path / "t.npz").write_bytes(content)
        with pytest.raises(InputFormatError, match=r"t\.npz: .*(give the \.npz|write it anew)"):
            model_npz.read(tmp_path / "t.npz")


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"parent": np.array([-1, 0, 1, 9, 3, 0], dtype=np.int32)}, "comes before its parent"),
        ({"radius": np.full(6, np.nan)}, "not finite"),
        ({"json": np.frombuffer(b"{}", dtype=np.uint8)}, "does not say treepipe-model"),
        ({"json": np.frombuffer(b"{", dtype=np.uint8)}, "makes? no tree"),
    ],
)
def test_arrays_that_make_no_tree_are_named(
    tree: TreeModel, tmp_path: Path, change: dict[str, np.ndarray], says: str
) -> None:
    model_npz.write(tree, tmp_path / "t.npz")
    with np.load(tmp_path / "t.npz") as held:
        arrays = {**{name: held[name] for name in held.files}, **change}
    np.savez(tmp_path / "t.npz", **arrays)  # type: ignore[arg-type]
    with pytest.raises(InputFormatError, match=says):
        model_npz.read(tmp_path / "t.npz")


def test_metadata_of_any_common_kind_is_kept() -> None:
    value = {
        "n": np.int32(3), "x": np.float32(0.5), "a": np.array([[1, 2]]), "t": (1, "é"), "s": {"b", "a"},
        "p": Path("a") / "b", "none": None, "yes": np.bool_(True), "inf": float("inf"), 5: {"deep": [1.5]},
    }  # fmt: skip
    assert from_json(to_json(value)) == {
        "n": 3, "x": 0.5, "a": ((1, 2),), "t": (1, "é"), "s": ("a", "b"),
        "p": "a/b", "none": None, "yes": True, "inf": None, "5": {"deep": (1.5,)},
    }  # fmt: skip
    assert to_json(value).isascii()
    assert "\n" not in to_json({"text": "two\nlines"})


def test_metadata_that_no_file_can_hold_is_named() -> None:
    with pytest.raises(ModelError, match=r"metadata\.deep\.thing is of type object"):
        to_json({"deep": {"thing": object()}})
