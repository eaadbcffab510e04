"""Rules: the report's own example, and what is refused."""

from __future__ import annotations

import pytest

from pipeline.errors import InputFormatError
from pipeline.lsystem import expand
from pipeline.lsystem.grammar import LONGEST, expanded_length

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
        InputFormatError, match=f"to {2**25:,} characters in 25 recursions, beyond the {LONGEST:,}"
    ):
        expand("F", {"F": "FF"}, 25)
    with pytest.raises(InputFormatError, match="to more than 1,000,000,000,000,000 characters"):
        expand("F", {"F": "FF"}, 10**9)


def test_rules_without_end_that_do_not_grow_are_bounded_too() -> None:
    with pytest.raises(InputFormatError, match="still change the L-string after 1,000 recursions"):
        expand("A", {"A": "AF"}, 10**8)


@pytest.mark.parametrize(
    ("axiom", "rules", "recursions"),
    [("A", {"A": "AB", "B": "A"}, 12), ("FFX", {"F": "", "X": "FXF"}, 7), ("AB", {"A": "B", "B": "A"}, 5)],
)
def test_the_length_is_known_without_expanding(axiom: str, rules: dict[str, str], recursions: int) -> None:
    on_the_way = [len(expand(axiom, rules, n)) for n in range(recursions + 1)]
    assert expanded_length(axiom, rules, recursions)[0] == max(on_the_way)


def test_a_predecessor_is_one_character() -> None:
    with pytest.raises(InputFormatError, match="rule 'XY' does not replace one character"):
        expand("F", {"XY": "F"}, 1)
