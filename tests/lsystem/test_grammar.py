"""Rules: the report's own example, and what is refused."""

from __future__ import annotations

import pytest

from pipeline.errors import InputFormatError
from pipeline.lsystem import expand
from pipeline.lsystem.grammar import LONGEST

FIBONACCI = ["A", "AB", "ABA", "ABAAB", "ABAABABA", "ABAABABAABAAB"]


@pytest.mark.parametrize("recursions", range(6))
def test_figure_3_5(recursions: int) -> None:
    assert expand("A", {"A": "AB", "B": "A"}, recursions) == FIBONACCI[recursions]


def test_no_rules_leave_the_axiom() -> None:
    assert expand("F(1)[F]", {}, 1_000_000_000) == "F(1)[F]"


def test_all_characters_are_replaced_at_once() -> None:
    assert expand("AB", {"A": "B", "B": "A"}, 1) == "BA"


def test_a_rule_may_erase() -> None:
    assert expand("F[X]", {"X": ""}, 1) == "F[]"


def test_growth_is_bounded() -> None:
    with pytest.raises(
        InputFormatError, match=f"past {LONGEST:,} characters after 24 recursions; lower 'recursions'"
    ):
        expand("F", {"F": "FF"}, 10**9)


def test_a_predecessor_is_one_character() -> None:
    with pytest.raises(InputFormatError, match="rule 'XY' does not replace one character"):
        expand("F", {"XY": "F"}, 1)
