"""Text to symbols and back."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.errors import InputFormatError
from pipeline.lsystem.tokens import number, tokenise


def test_symbols_and_values() -> None:
    symbols, values = tokenise("F(1.5)[+ -(0.25)\nX()!(1e-2)]")
    assert symbols.tobytes() == b"F[+-X!]"
    np.testing.assert_array_equal(values, [1.5, np.nan, np.nan, 0.25, np.nan, 0.01, np.nan])


def test_nothing_is_nothing() -> None:
    assert [len(part) for part in tokenise("")] == [0, 0]


@pytest.mark.parametrize(
    ("value", "text"), [(0.414, "0.414"), (2.0, "2"), (0.0001, "0.0001"), (123456.789, "123456.789")]
)
def test_numbers_are_short(value: float, text: str) -> None:
    assert number(value) == text
    assert float(text) == value


@pytest.mark.parametrize("text", ["F(1) ", "F[+F]\n(1)", "\n(1)", " )F[", "F(1) \\+]F7"])
def test_white_space_before_a_fault(text: str) -> None:
    """Python's regular expressions have failed here."""
    if text.strip() == "F(1)":
        assert tokenise(text)[0].tolist() == [ord("F")]
    else:
        with pytest.raises(InputFormatError, match="at character"):
            tokenise(text)
