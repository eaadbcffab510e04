"""The file: keys in a fixed order, read back as written, errors that name it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from pipeline.errors import InputFormatError, InputMissingError, OutputError
from pipeline.lsystem import decode, encode, read_lsjson, write_lsjson
from pipeline.model import TreeModel

PLAIN: dict[str, Any] = {"axiom": "F(1)", "trunk": {"anchor": [0, 0, 0], "radius": 0.1}}


def test_what_is_written_is_read(tmp_path: Path, bush: TreeModel) -> None:
    document = encode(bush)
    write_lsjson(document, tmp_path / "bush.ls.json")
    assert read_lsjson(tmp_path / "bush.ls.json") == document


def test_the_same_document_gives_the_same_bytes_in_any_key_order(tmp_path: Path, bush: TreeModel) -> None:
    document = {**encode(bush), "zebra": 1, "ape": 2}
    write_lsjson(document, tmp_path / "a.ls.json")
    write_lsjson(dict(reversed(document.items())), tmp_path / "b.ls.json")
    text = (tmp_path / "a.ls.json").read_text(encoding="utf-8")
    assert text == (tmp_path / "b.ls.json").read_text(encoding="utf-8")
    assert list(json.loads(text)) == [
        *("format", "crs", "degrees", "dimensions", "trunk", "radius", "recursions", "rules", "axiom"),
        *("ape", "zebra"),
    ]
    assert text.count("\n") == len(document) + 2


def test_decode_then_encode_gives_the_same_file(tmp_path: Path, bush: TreeModel) -> None:
    write_lsjson(encode(bush), tmp_path / "a.ls.json")
    write_lsjson(encode(decode(read_lsjson(tmp_path / "a.ls.json"))), tmp_path / "b.ls.json")
    assert (tmp_path / "a.ls.json").read_bytes() == (tmp_path / "b.ls.json").read_bytes()


def test_letters_beyond_ascii_and_a_byte_order_mark(tmp_path: Path) -> None:
    write_lsjson({**PLAIN, "id": "kastanje-é"}, tmp_path / "a.ls.json")
    assert "kastanje-é" in (tmp_path / "a.ls.json").read_text(encoding="utf-8")
    (tmp_path / "b.ls.json").write_text(json.dumps(PLAIN), encoding="utf-8-sig")
    assert read_lsjson(tmp_path / "b.ls.json") == PLAIN


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    for path in (tmp_path / "none.ls.json", tmp_path):
        with pytest.raises(InputMissingError, match=f"{path}: no such file; give the name"):
            read_lsjson(path)


@pytest.mark.parametrize("content", [b"", b"{", b"\xff\xfe\x00", b"[" * 100_000])
def test_what_is_not_json_is_named(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "bad.ls.json"
    path.write_bytes(content)
    with pytest.raises(
        InputFormatError, match=r"bad\.ls\.json: cannot be read as JSON.*give an \.ls\.json file"
    ):
        read_lsjson(path)


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"axiom": 3}, "not an LsJSON: axiom: "),
        ({"rules": {"X": 3}}, r"rules\.X: "),
        ({"recursions": -1}, "recursions: "),
        ({"recursions": 0.5}, "recursions: "),
        ({"degrees": "yes"}, "degrees: "),
        ({"dimensions": {"forward": "far"}}, r"dimensions\.forward: "),
        ({"trunk": {"anchor": [0], "radius": 1}}, r"trunk\.anchor: "),
        ({"trunk": {"anchor": [0, 0, "x"], "radius": 1}}, r"trunk\.anchor\.2: "),
        ({"trunk": {"anchor": [0, 0, 0], "radius": -1}}, r"trunk\.radius: "),
        ({"trunk": {"anchor": [0, 0, 0]}}, r"trunk\.radius: field required; mend it as docs/lsystem.md says"),
        ({"format": {"name": "other", "version": 1}}, r"format\.name: "),
        ({"format": {"name": "lsjson", "version": 99}}, r"format\.version: .* a newer one may read it"),
        ({"radius": {"rule": "magic"}}, r"radius\.rule: "),
        ({"rules": {"XY": "F"}}, "give one character per rule"),
    ],
)
def test_a_wrong_key_is_named(keys: dict[str, Any], words: str) -> None:
    with pytest.raises(InputFormatError, match=words):
        decode({**PLAIN, **keys})


def test_a_wrong_key_in_a_file_names_the_file(tmp_path: Path) -> None:
    path = tmp_path / "short.ls.json"
    path.write_text('{"axiom": "F"}', encoding="utf-8")
    with pytest.raises(InputFormatError, match=r"short\.ls\.json: not an LsJSON: trunk: field required"):
        read_lsjson(path)
    path.write_text("[1, 2]", encoding="utf-8")
    with pytest.raises(InputFormatError, match=r"not an LsJSON: the document: should be a JSON object"):
        read_lsjson(path)


def test_an_unwritable_place_is_named(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="is a directory"):
        write_lsjson(PLAIN, tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_the_example_of_the_specification_is_what_we_write() -> None:
    text = (Path(__file__).parents[2] / "docs" / "lsystem.md").read_text(encoding="utf-8")
    example = json.loads(text.split("```json\n")[1].split("```")[0])
    tree = decode(example)
    assert encode(tree) == example
    assert tree.skeleton.order.tolist() == [0, 0, 0, 1]
    assert tree.skeleton.world[3].tolist() == pytest.approx([120000.5, 487000, 2.25])
    assert tree.radius[3] == 0.015
