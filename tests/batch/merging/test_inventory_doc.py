"""The tables of docs/inventory.md are those of the code; run this file as a script to write them anew."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

import pytest

from pipeline.airborne.dutch import CROWN_BOUNDS_M, HEIGHT_BOUNDS_M, classes, columns
from pipeline.airborne.inventory import Column
from pipeline.batch.columns import MERGED
from pipeline.batch.merging.statistics import STATISTICS

PAGE = Path(__file__).resolve().parents[3] / "docs" / "inventory.md"

TABLES = {"columns": MERGED, "statistics": STATISTICS}


def written(columns: Iterable[Column]) -> str:
    rows = [f"| `{one.name}` | {one.dtype} | {one.unit} | {one.about} |" for one in columns]
    return "\n".join(["| column | type | unit | |", "|---|---|---|---|", *rows])


def renewed(text: str) -> str:
    for name, held in TABLES.items():
        marks = f"<!-- {name}: begin -->\n", f"<!-- {name}: end -->"
        text = re.sub(
            f"{marks[0]}.*?{marks[1]}",
            lambda _found, marks=marks, held=held: f"{marks[0]}{written(held)}\n{marks[1]}",
            text,
            flags=re.DOTALL,
        )
    return text


def test_the_tables_are_those_of_the_code():
    text = PAGE.read_text(encoding="utf-8")
    assert renewed(text) == text, f"run `python {Path(__file__).name}` to write the tables anew"
    assert all(written(held) in text for held in TABLES.values())


@pytest.mark.parametrize("bounds", [(HEIGHT_BOUNDS_M, "hoger"), (CROWN_BOUNDS_M, "groter")])
def test_the_dutch_names_are_those_of_the_code(bounds):
    text = PAGE.read_text(encoding="utf-8")
    assert ", ".join(classes(*bounds)).replace(" m.,", ",") in text
    assert all(f"`{name}`" in text for name in columns())


def test_names_are_told_once_and_short():
    names = [column.name for column in MERGED]
    assert len(set(names)) == len(names)
    assert all(len(name) <= 24 for name in names)


if __name__ == "__main__":
    PAGE.write_text(renewed(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
