"""Packing loses nothing: the same document comes back, whatever its axiom."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.errors import InputFormatError
from pipeline.lsystem import LsystemOptions, encode
from pipeline.lsystem.storage.packing import pack, unpack
from pipeline.model import TreeModel


def document_of(axiom: str) -> dict[str, Any]:
    return {"id": "oak", "axiom": axiom, "trunk": {"anchor": [0.0, 0.0, 0.0], "radius": 0.1}, "zebra": [1]}


@st.composite
def regular_axioms(draw: st.DrawFn) -> str:
    """Axioms as `encode` writes them: shortest numbers, angles with decimals that follow the length."""

    def value(low: int, high: int, places: int) -> str:
        return f"{draw(st.integers(low, high)) / 10**places:.12g}"

    pieces, open_ = [], 0
    for _ in range(draw(st.integers(1, 12))):
        if draw(st.booleans()):
            pieces.append("[")
            open_ += 1
        length = draw(st.integers(0, 30_000)) / 1000
        places = sum(length >= limit for limit in (0.0229, 0.229, 2.29, 22.9))
        for signs in ("+-", "><"):
            if draw(st.booleans()):
                pieces.append(f"{draw(st.sampled_from(signs))}({value(1, 180 * 10**places, places)})")
        if draw(st.booleans()):
            pieces.append(f"!({value(0, 20_000, 4)})")
        pieces.append(f"F({length:.12g})")
        if open_ and draw(st.booleans()):
            pieces.append("]")
            open_ -= 1
    return "".join(pieces) + "]" * open_


@given(regular_axioms())
def test_what_is_regular_is_packed_and_comes_back(axiom: str) -> None:
    document = document_of(axiom)
    packed = pack(document)
    assert "axiom" not in packed
    assert packed["packed"]["decimals"]["angle"] == 0
    assert unpack(json.loads(json.dumps(packed))) == document


@given(st.one_of(st.text("F!+-<>[]().0123456789 X", max_size=60), st.text(max_size=20)))
def test_anything_else_comes_back_too(axiom: str) -> None:
    document = document_of(axiom)
    assert unpack(json.loads(json.dumps(pack(document)))) == document


@pytest.mark.parametrize(
    "axiom",
    [
        "",
        "F",
        "F(1)X",
        "F(1.0)",
        "F(01)",
        "+(0)F(1)",
        "F(1) F(2)",
        "!(0.1)F(1)!(0.2)",
        "-(90)>(3)+(2)F(1)",
        "F(1e3)",
        "F(1)[+(9)]",
        "F(99999999)",
        "F(1)\N{ARABIC-INDIC DIGIT ONE}",
        "F(\N{ARABIC-INDIC DIGIT ONE})",
    ],
)
def test_what_is_irregular_stays_plain(axiom: str) -> None:
    document = document_of(axiom)
    assert pack(document) == document
    assert unpack(document) == document


def test_columns_by_hand() -> None:
    packed = pack(document_of("-(90)F(1)[+(45)!(0.015)F(0.064)]>(12.5)F(0.5)"))
    assert packed["packed"] == {
        "nodes": "F[!]F",
        "decimals": {"length": 3, "angle": 0, "radius": 3},
        # 1000 = 15·64 + 40, 64 = 1·64 + 0, 500 = 7·64 + 52
        "length": ["PBH", "oA0"],
        # -90.00 at 1 m: -9000 -> 17999 = 4·4096 + 25·64 + 15; 45.0 at 6 cm: 450 -> 900 = 14·64 + 4
        "rotation": ["EAA", "ZOA", "PEA"],
        # 12.50 at 0.5 m: 1250 -> 2500 = 39·64 + 4
        "roll": ["AAn", "AAE"],
        "radius": ["P"],
    }


@pytest.mark.parametrize(
    "options",
    [
        LsystemOptions(),
        LsystemOptions(radii="none"),
        LsystemOptions(radii="all", angle_decimals=4),
        LsystemOptions(length_decimals=1),
        LsystemOptions(length_decimals=4),
    ],
)
def test_what_encode_writes_is_packed(bush: TreeModel, options: LsystemOptions) -> None:
    document = encode(bush, options=options)
    packed = pack(document)
    assert "axiom" not in packed
    assert packed["packed"]["decimals"]["angle"] in (0, options.angle_decimals)
    assert unpack(packed) == document
    assert len(json.dumps(packed)) < 0.6 * len(json.dumps(document))


def test_a_key_called_packed_of_another_program_is_left_alone() -> None:
    document = {**document_of("F(1)"), "packed": "lunch"}
    assert pack(document) == document
    assert unpack(document) == document


def test_seeded_noise_in_the_columns_never_passes_unnoticed(bush: TreeModel) -> None:
    document = encode(bush)
    packed = pack(document)
    rng = np.random.default_rng(1)
    for key in ("length", "rotation", "roll", "radius"):
        plane = packed["packed"][key][-1]
        at = int(rng.integers(len(plane)))
        other = "A" if plane[at] != "A" else "B"
        changed = [*packed["packed"][key][:-1], plane[:at] + other + plane[at + 1 :]]
        assert unpack({**packed, "packed": {**packed["packed"], key: changed}}) != document


GOOD = pack(document_of("F(1)[!(0.1)F(2)]"))["packed"]


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"nodes": "FxF"}, "packed.nodes: 'x' is none of F"),
        ({"nodes": "FFF"}, "packed.length: 2 digits, not 3"),
        ({"radius": ["AA"]}, "packed.radius: 2 digits, not 1 of A-Z"),
        ({"roll": ["é"]}, "packed.roll: 1 digits, not 2"),
        ({"roll": ["~~"]}, "packed.roll: 2 digits, not 2 of A-Z a-z 0-9"),
        ({"length": ["AB"] * 9}, "packed.length: list should have at most 8 items"),
        ({"length": 3}, "packed.length: input should be a valid list"),
        (
            {"decimals": {"length": 3, "angle": 0, "radius": 99}},
            "packed.decimals.radius: input should be less",
        ),
    ],
)
def test_corrupt_columns_are_named(change: dict[str, Any], text: str) -> None:
    with pytest.raises(InputFormatError, match=f"^{text}.*; write it again$"):
        unpack({"packed": {**GOOD, **change}})
