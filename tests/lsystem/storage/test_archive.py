"""Archives and compressed files: what goes in comes out, in bounded memory, and what is broken is named."""

from __future__ import annotations

import json
import shutil
import subprocess
import tracemalloc
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import pytest
import zstandard

from pipeline.errors import InputFormatError, InputMissingError, OutputError, UsageError
from pipeline.lsystem import encode, write_lsjson
from pipeline.lsystem.storage import archive as archive_module
from pipeline.lsystem.storage import compressed
from pipeline.lsystem.storage.archive import Archive, ArchiveWriter, split_member
from pipeline.lsystem.storage.compressed import decompress, read_compressed, write_compressed
from pipeline.lsystem.storage.index import Frame, Index, index_frame
from pipeline.model import TreeModel

Document = dict[str, Any]


def document_of(number: int) -> Document:
    axiom = f"-(90)F({number + 1})[+({number % 90 + 1})!(0.02)F(0.5)]F(1.5)"
    return {
        "format": {"name": "lsjson", "version": 1},
        "axiom": axiom,
        "trunk": {"anchor": [1.0, 2.0, 3.0], "radius": 0.1},
    }


def write_all(path: Path, trees: Iterable[tuple[str, Document]]) -> Path:
    with ArchiveWriter(path) as archive:
        for id, document in trees:
            archive.add(id, document)
    return path


def write(path: Path, count: int) -> Path:
    return write_all(path, ((f"t{number}", document_of(number)) for number in range(count)))


@pytest.fixture
def park(tmp_path: Path) -> Path:
    """An archive of 250 trees in three frames."""
    return write(tmp_path / "park.lsjson.jsonl.zst", 250)


# Archives


def test_any_tree_and_all_in_order(park: Path) -> None:
    archive = Archive(park)
    wanted = [{**document_of(n), "id": f"t{n}"} for n in range(250)]
    assert archive.ids == tuple(document["id"] for document in wanted)
    assert len(archive) == 250
    assert "t7" in archive
    assert "t250" not in archive
    assert [frame.lines for frame in archive.index.frames] == [100, 100, 50]
    assert list(archive) == wanted
    assert [archive.read(id) for id in archive.ids] == wanted


def test_a_large_tree_among_small_ones(tmp_path: Path, bush: TreeModel) -> None:
    document = {**encode(bush), "id": "kastanje \N{CHESTNUT}\n#2"}
    with ArchiveWriter(tmp_path / "a.lsjson.jsonl.zst") as archive:
        archive.add("small", document_of(1))
        archive.add(document["id"], document)
    assert Archive(tmp_path / "a.lsjson.jsonl.zst").read(document["id"]) == document
    assert (tmp_path / "a.lsjson.jsonl.zst").stat().st_size < 8.5 * len(bush)


def test_plain_tools_stream_the_lines(park: Path) -> None:
    content = park.read_bytes()
    with zstandard.ZstdDecompressor().stream_reader(content, read_across_frames=True) as reader:
        lines = reader.read(10_000_000).decode().splitlines()
    assert [json.loads(line)["id"] for line in lines] == [f"t{n}" for n in range(250)]
    assert all(line.startswith('{"id":') and "packed" in line for line in lines)
    if shutil.which("zstdcat"):
        told = subprocess.run(["zstdcat", park], capture_output=True, check=True).stdout
        assert told.decode().splitlines() == lines


def test_the_same_documents_give_the_same_bytes(tmp_path: Path, park: Path) -> None:
    with ArchiveWriter(tmp_path / "b.lsjson.jsonl.zst") as archive:
        for document in Archive(park):
            archive.add(document["id"], dict(reversed(document.items())))
    assert (tmp_path / "b.lsjson.jsonl.zst").read_bytes() == park.read_bytes()


def test_an_archive_of_nothing(tmp_path: Path) -> None:
    archive = Archive(write(tmp_path / "none.lsjson.jsonl.zst", 0))
    assert (len(archive), archive.ids, list(archive)) == (0, (), [])
    with pytest.raises(InputMissingError, match="has no tree 'oak' among its 0 "):
        archive.read("oak")


def test_frames_end_by_bytes_as_well(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(archive_module, "FRAME_BYTES", 2_000)
    archive = Archive(write(tmp_path / "a.lsjson.jsonl.zst", 50))
    lines = [frame.lines for frame in archive.index.frames]
    assert sum(lines) == 50
    assert len(lines) > 5
    assert len(list(archive)) == 50


def test_memory_is_that_of_a_frame(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(archive_module, "FRAME_BYTES", 2**17)
    document, path, peaks = document_of(1), tmp_path / "a.lsjson.jsonl.zst", []
    document["axiom"] *= 500
    for count in (20, 100):
        tracemalloc.start()
        with ArchiveWriter(path, level=1) as archive:
            for number in range(count):
                archive.add(f"t{number}", document)
        written = tracemalloc.get_traced_memory()[1]
        tracemalloc.reset_peak()
        assert sum(1 for _ in Archive(path)) == count
        peaks.append((written, tracemalloc.get_traced_memory()[1]))
        tracemalloc.stop()
    assert len(Archive(path).index.frames) > 5
    for few, many in zip(*peaks, strict=True):
        assert many < 1.2 * few


def test_one_tree_costs_its_frame_and_the_tail(park: Path) -> None:
    """All bytes of other frames are spoilt, and nothing notices."""
    frames = Archive(park).index.frames
    content = bytearray(park.read_bytes())
    for frame in (frames[0], frames[2]):
        content[frame.offset : frame.offset + frame.size] = bytes(frame.size)
    park.write_bytes(content)
    assert Archive(park).read("t150")["id"] == "t150"
    with pytest.raises(InputFormatError, match="no sound Zstandard file"):
        Archive(park).read("t50")


def test_members_on_the_command_line() -> None:
    assert split_member("a/x.lsjson.jsonl.zst#t1") == ("a/x.lsjson.jsonl.zst", "t1")
    assert split_member("x.lsjson.jsonl.zst#a#b.lsjson.jsonl.zst#c") == (
        "x.lsjson.jsonl.zst",
        "a#b.lsjson.jsonl.zst#c",
    )
    assert split_member("x.lsjson.jsonl.zst") == ("x.lsjson.jsonl.zst", None)
    assert split_member("tree#1.ls.json.zst") == ("tree#1.ls.json.zst", None)


# What cannot be written


@pytest.mark.parametrize(
    ("id", "document", "text"),
    [
        ("t0", document_of(1), "tree 't0' is there already; give every tree an id of its own"),
        ("", document_of(1), "has an empty id; name it"),
        ("a", {**document_of(1), "id": "b"}, "tree 'a' says that it is 'b'; make them agree"),
        ("a", {"axiom": "F"}, "tree 'a' cannot be written .*trunk: field required"),
        ("a", {**document_of(1), "x": float("nan")}, "tree 'a' cannot be written .*; give what encode"),
        ("a", {**document_of(1), "x": {1, 2}}, "tree 'a' cannot be written .*; give what encode"),
        ("\ud800", document_of(1), "cannot be written .*; give what encode"),
    ],
)
def test_a_wrong_tree_leaves_nothing_behind(tmp_path: Path, id: str, document: Document, text: str) -> None:
    path = tmp_path / "a.lsjson.jsonl.zst"
    with pytest.raises((UsageError, InputFormatError), match=f"{path}: .*{text}"):
        write_all(path, [("t0", document_of(0)), (id, document)])
    assert list(tmp_path.iterdir()) == []


def test_a_failure_leaves_the_old_archive(park: Path) -> None:
    before = park.read_bytes()
    new = ((f"n{number}", document_of(300 // (200 - number))) for number in range(300))
    with pytest.raises(ZeroDivisionError):
        write_all(park, new)
    assert park.read_bytes() == before
    assert list(park.parent.iterdir()) == [park]


def test_a_tree_too_long_for_a_reader_is_not_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(archive_module, "LARGEST_BYTES", 100)
    monkeypatch.setattr(compressed, "LARGEST_BYTES", 100)
    with (
        pytest.raises(OutputError, match=r"tree 'a' has \d+ bytes, .*\(100\); simplify it"),
        ArchiveWriter(tmp_path / "a.lsjson.jsonl.zst") as archive,
    ):
        archive.add("a", document_of(1))
    with pytest.raises(OutputError, match=r"a.zst: 101 bytes are more .*; write .ls.json"):
        write_compressed(tmp_path / "a.zst", "x" * 101)


def test_a_folder_that_cannot_be(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="cannot be written"):
        write(tmp_path / "file" / "a.lsjson.jsonl.zst", 1)


def test_trees_are_added_inside_with_alone(tmp_path: Path) -> None:
    path = tmp_path / "a.lsjson.jsonl.zst"
    writer = ArchiveWriter(path)
    with pytest.raises(UsageError, match="is not open; add trees inside `with"):
        writer.add("t0", document_of(0))
    with writer:
        writer.add("t0", document_of(0))
    with pytest.raises(UsageError, match="is not open; add trees inside `with"):
        writer.add("t1", document_of(1))
    assert Archive(path).ids == ("t0",)


# What cannot be read


def test_a_tree_that_is_not_there(park: Path) -> None:
    with pytest.raises(InputMissingError, match=r"no tree 't20x' among its 250 \(near it are 't20'.*\)"):
        Archive(park).read("t20x")
    with pytest.raises(InputMissingError, match=r"no tree 'oak' among its 250 \(no id comes near\)"):
        Archive(park).read("oak")
    with pytest.raises(InputMissingError, match=r"none\.lsjson\.jsonl\.zst: no such file"):
        Archive(park.with_name("none.lsjson.jsonl.zst"))


def test_a_file_that_is_cut_off_anywhere(park: Path) -> None:
    content = park.read_bytes()
    for size in (1, 11, 19, 20, len(content) // 2, Archive(park).index.frames[1].offset, len(content) - 1):
        park.write_bytes(content[:size])
        with pytest.raises(InputFormatError, match=f"{park}: has no index at its end .it was cut off"):
            Archive(park)
    park.write_bytes(b"")
    with pytest.raises(InputFormatError, match=f"{park}: has no index at its end .the file is empty"):
        Archive(park)


def test_every_spoilt_byte_is_noticed_or_harmless(tmp_path: Path) -> None:
    path = write(tmp_path / "a.lsjson.jsonl.zst", 3)
    content, wanted = path.read_bytes(), list(Archive(path))
    for at in range(len(content)):
        path.write_bytes(content[:at] + bytes([content[at] ^ 0x10]) + content[at + 1 :])
        try:
            assert list(Archive(path)) == wanted
        except InputFormatError as error:
            assert str(path) in str(error)  # noqa: PT017 - either outcome is right


def replace_index(path: Path, index: Index) -> None:
    frames = Archive(path).index.frames
    start = frames[-1].offset + frames[-1].size
    path.write_bytes(path.read_bytes()[:start] + index_frame(index, start, path))


CHANGES: dict[str, Callable[[Index], Index]] = {
    "does not fit": lambda i: Index(frames=i.frames, ids=i.ids[:-1]),
    "does not fit the file": lambda i: Index(frames=i.frames[1:], ids=i.ids[100:]),
    "two trees have one id": lambda i: Index(frames=i.frames, ids=("t1", *i.ids[1:])),
    "wrong at version": lambda i: i.model_copy(update={"version": 2}),
    "wrong at frames.0.2": lambda i: i.model_copy(update={"frames": (Frame(0, 5, 0),)}),
}


@pytest.mark.parametrize("text", CHANGES)
def test_an_index_that_does_not_fit(park: Path, text: str) -> None:
    replace_index(park, CHANGES[text](Archive(park).index))
    with pytest.raises(InputFormatError, match=f"{park}: .*{text}.*; write"):
        Archive(park)


def test_an_index_that_lies_is_found_out_on_reading(park: Path) -> None:
    index = Archive(park).index
    replace_index(park, index.model_copy(update={"ids": ("t1", "t0", *index.ids[2:])}))
    with pytest.raises(InputFormatError, match=f"{park}: tree 't0' stands in the place of 't1'; write"):
        Archive(park).read("t1")
    first, second, third = index.frames
    frames = (first._replace(lines=99), second._replace(lines=101), third)
    replace_index(park, index.model_copy(update={"frames": frames}))
    with pytest.raises(InputFormatError, match=f"{park}: a frame has 100 lines, not 99; write"):
        Archive(park).read("t0")


def test_lines_that_are_no_documents(tmp_path: Path) -> None:
    path = tmp_path / "a.lsjson.jsonl.zst"
    for line in (b"{\n", b'"oak"\n', b"\xff\n", b"[" * 100_000 + b"\n", b'{"id":"a","packed":{}}\n'):
        frame = compressed.compress(line, path)
        index = Index(frames=(Frame(0, len(frame), 1),), ids=("a",))
        path.write_bytes(frame + index_frame(index, len(frame), path))
        with pytest.raises(InputFormatError, match=f"{path}: tree 'a' cannot be read .*; write the archive"):
            Archive(path).read("a")


# Compressed files


def test_a_compressed_file_is_the_plain_one(tmp_path: Path, bush: TreeModel) -> None:
    write_lsjson(encode(bush), tmp_path / "a.ls.json")
    text = (tmp_path / "a.ls.json").read_text(encoding="utf-8")
    write_compressed(tmp_path / "a.ls.json.zst", text)
    write_compressed(tmp_path / "b.ls.json.zst", text)
    assert read_compressed(tmp_path / "a.ls.json.zst") == text
    assert (tmp_path / "a.ls.json.zst").read_bytes() == (tmp_path / "b.ls.json.zst").read_bytes()
    assert (tmp_path / "a.ls.json.zst").stat().st_size < 0.4 * len(text)


def test_several_frames_a_byte_order_mark_and_an_unknown_size(tmp_path: Path) -> None:
    path = tmp_path / "a.ls.json.zst"
    frame = zstandard.ZstdCompressor(write_content_size=False).compress
    skipped = (0x184D2A50).to_bytes(4, "little") + (3).to_bytes(4, "little") + b"abc"
    path.write_bytes(frame("\ufeff{".encode()) + skipped + frame(b"}"))
    assert read_compressed(path) == "{}"


def test_a_bomb_is_refused_before_it_goes_off(tmp_path: Path) -> None:
    path = tmp_path / "bomb.ls.json.zst"
    compressor = zstandard.ZstdCompressor(level=1, write_content_size=False).compressobj()
    pieces = [compressor.compress(bytes(2**20)) for _ in range(512)]
    path.write_bytes(b"".join(pieces) + compressor.flush())
    assert path.stat().st_size < 100_000
    tracemalloc.start()
    with pytest.raises(InputFormatError, match=f"{path}: holds more than 67,108,864 bytes"):
        read_compressed(path)
    assert tracemalloc.get_traced_memory()[1] < 2**21
    tracemalloc.stop()


def test_a_limit_is_kept_to_the_byte(tmp_path: Path) -> None:
    packed = compressed.compress(b"x" * 1000, tmp_path)
    assert decompress(packed, tmp_path, limit=1000) == b"x" * 1000
    with pytest.raises(InputFormatError, match="more than 999 bytes"):
        decompress(packed, tmp_path, limit=999)


@pytest.mark.parametrize(
    ("spoil", "text"),
    [
        (lambda c: c[:-5], "is cut off; copy or write it again"),
        (lambda c: c[:3], "is cut off; copy or write it again"),
        (lambda _: b"", "is cut off"),
        (
            lambda c: c[:40] + bytes([c[40] ^ 1]) + c[41:],
            "no sound Zstandard file .*; copy or write it again",
        ),
        (lambda c: c + b"and more", "no sound Zstandard file"),
        (lambda _: b'{"axiom": "F"}', "no sound Zstandard file"),
        (lambda _: compressed.compress(b"\xff\xfe", Path()), "cannot be read as compressed text in UTF-8"),
    ],
)
def test_a_corrupt_file_is_named(tmp_path: Path, spoil: Callable[[bytes], bytes], text: str) -> None:
    path = tmp_path / "a.ls.json.zst"
    write_compressed(path, json.dumps(document_of(1)))
    path.write_bytes(spoil(path.read_bytes()))
    with pytest.raises(InputFormatError, match=f"{path}: .*{text}"):
        read_compressed(path)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    for path in (tmp_path / "none.ls.json.zst", tmp_path):
        with pytest.raises(InputMissingError, match=f"{path}: no such file; give the name"):
            read_compressed(path)
