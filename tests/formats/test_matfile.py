"""MATLAB files: what scipy writes is read alike, in either form; damage is an error."""

from __future__ import annotations

import contextlib
import io
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.io import savemat

from pipeline.formats.matfile import variables

HELD = {
    "QSM": {"cylinder": {"radius": np.array([[0.5], [0.25]]), "branch": np.array([[1], [300]], dtype="u2")}},
    "note": "text is passed over",
    "cells": np.array([np.eye(2), "x"], dtype=object),
}


def saved(*, compressed: bool) -> bytes:
    whole = io.BytesIO()
    savemat(whole, HELD, do_compression=compressed)
    return whole.getvalue()


@pytest.mark.parametrize("compressed", [False, True])
def test_structures_cells_and_numbers(compressed: bool) -> None:
    qsm, note, cells = variables(saved(compressed=compressed))
    cylinder: Any = qsm[0]["cylinder"][0]
    assert cylinder["radius"].tolist() == [[0.5], [0.25]]
    assert cylinder["branch"].tolist() == [[1], [300]]
    assert note is None
    assert cells[0].tolist() == [[1, 0], [0, 1]]
    assert cells[1] is None


def test_it_is_what_it_says_it_is() -> None:
    with pytest.raises(ValueError, match="does not begin as"):
        list(variables(b"hello"))
    with pytest.raises(ValueError, match="cut short"):
        list(variables(saved(compressed=False)[:300]))


@settings(max_examples=200)
@given(st.binary(max_size=40), st.integers(128, 1000), st.booleans())
def test_damage_is_an_error(junk: bytes, place: int, compressed: bool) -> None:
    whole = bytearray(saved(compressed=compressed))
    whole[place : place + len(junk)] = junk
    with contextlib.suppress(ValueError):
        list(variables(bytes(whole)))
