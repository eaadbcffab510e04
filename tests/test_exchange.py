"""Every format by name and suffix: what is written comes back, what is unknown is refused."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.errors import InputFormatError, InputMissingError, UsageError
from pipeline.exchange import DEFAULT_FORMATS, FORMATS, format_of, parse_formats, read_model, stem_of, write
from pipeline.model import Skeleton, TreeModel
from pipeline.synthetic import TubeTreeOptions, grow_tubes

LATER = "obj glb swc treefile treeqsm simpleforest mtg lstring gpkg lsjson-zst"


@pytest.fixture(scope="module")
def tree():
    return grow_tubes(TubeTreeOptions(seed=3, height_m=4.0, max_order=1))


@pytest.mark.parametrize("name", [name for name, known in FORMATS.items() if known.read])
def test_round_trip(tree, name, tmp_path):
    path = tmp_path / f"oak{FORMATS[name].suffix}"
    write(tree, path)
    back = read_model(path)
    assert isinstance(back, TreeModel)
    assert len(back) == len(tree)
    assert back.volume.sum() == pytest.approx(tree.volume.sum(), rel=0.02)
    assert back.skeleton.length.sum() == pytest.approx(tree.skeleton.length.sum(), rel=0.005)
    assert np.allclose(np.sort(back.skeleton.world, axis=0), np.sort(tree.skeleton.world, axis=0), atol=6e-4)


def test_mesh_is_written_only(tree, tmp_path):
    write(tree, tmp_path / "oak.mesh.ply")
    with pytest.raises(InputFormatError, match=r"oak\.mesh\.ply.*\.ls\.json"):
        read_model(tmp_path / "oak.mesh.ply")


def test_plain_json_and_ply_are_read_by_content(tree, tmp_path):
    for suffix, plain in ((".ls.json", "a.json"), (".city.json", "b.json"), (".skeleton.ply", "c.ply")):
        write(tree, tmp_path / f"oak{suffix}")
        (tmp_path / f"oak{suffix}").rename(tmp_path / plain)
        assert len(read_model(tmp_path / plain)) == len(tree)


def test_files_of_2021_are_read(shared_data):
    for name in ("LAS00_9_lsystem.json", "LAS00_9_skeleton.ply"):
        model = read_model(shared_data / "ls2021" / name)
        assert isinstance(model, TreeModel | Skeleton)
        assert len(model) > 100


def test_defaults_are_formats():
    assert set(DEFAULT_FORMATS) <= set(FORMATS)
    assert parse_formats(",".join(DEFAULT_FORMATS)) == DEFAULT_FORMATS


def test_parse_formats_keeps_order_and_drops_repeats():
    assert parse_formats(" mesh, lsjson,mesh ,") == ("mesh", "lsjson")


@pytest.mark.parametrize(
    "name", ["nonsense", "lsjsn", *[each for each in LATER.split() if each not in FORMATS]]
)
def test_unknown_format_lists_the_known(name):
    with pytest.raises(UsageError, match="known: lsjson, cityjson, skeleton, mesh, qsm"):
        parse_formats(f"lsjson,{name}")


def test_no_format_is_refused():
    with pytest.raises(UsageError, match="comma list"):
        parse_formats(" , ")


def test_unknown_suffix_lists_the_known(tree, tmp_path):
    with pytest.raises(UsageError, match=r"\.ls\.json, \.city\.json"):
        write(tree, tmp_path / "oak.json")
    with pytest.raises(InputFormatError, match=r"oak\.doc.*\.ls\.json"):
        read_model(tmp_path / "oak.doc")


@pytest.mark.parametrize("suffix", [known.suffix for known in FORMATS.values() if known.read])
def test_missing_file_is_named(suffix, tmp_path):
    with pytest.raises(InputMissingError, match="absent"):
        read_model(tmp_path / f"absent{suffix}")


@pytest.mark.parametrize("suffix", [known.suffix for known in FORMATS.values() if known.read])
@pytest.mark.parametrize("content", [b"", b"{}", b"\x00\xff rubbish"])
def test_damaged_file_is_named(suffix, content, tmp_path):
    path = tmp_path / f"bad{suffix}"
    path.write_bytes(content)
    with pytest.raises(InputFormatError, match=r"bad\."):
        read_model(path)


def test_stem_of():
    assert [stem_of(p) for p in ("out/oak.ls.json", "a.b.npz", "X.CITY.JSON", "t.obj")] == [
        "oak",
        "a.b",
        "X",
        "t",
    ]
    assert format_of("X.QSM.CSV") is FORMATS["qsm"]
