"""Crowns in canopies made by hand: saddles, ties, reach."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.airborne.crowns import METHODS, CrownOptions, by_prominence

CELL_M = 0.5


def two_peaks(saddle: float, low: float = 10.0, high: float = 12.0) -> np.ndarray:
    """A ridge in row 3 of an empty canopy: up to `low`, down to the saddle, up to `high`, and down."""
    chm = np.zeros((7, 13))
    chm[3, 1:12] = [7, 8, 9, low, saddle, 11, high, 10, 9, 8, 7]
    return chm


def tops(crowns: np.ndarray) -> set[int]:
    return set(crowns[crowns >= 0].tolist())


@pytest.mark.parametrize(("dip", "trees"), [(0.10, 1), (0.14, 1), (0.16, 2), (0.30, 2)])
def test_a_treetop_rises_above_the_saddle_by_its_prominence(dip: float, trees: int) -> None:
    assert len(tops(by_prominence(two_peaks(10.0 - dip), CELL_M, CrownOptions()))) == trees


def test_the_prominence_is_a_setting() -> None:
    assert len(tops(by_prominence(two_peaks(9.7), CELL_M, CrownOptions(prominence_m=0.5)))) == 1


@pytest.mark.parametrize(("dip", "trees"), [(0.35, 1), (0.45, 2)])
def test_tops_3_m_apart_ask_for_a_valley_45_cm_below_the_line_between_them(dip: float, trees: int) -> None:
    chm = np.zeros((3, 11))
    chm[1, 1:10] = [9, 10, 9.9, 9.8, 10 - dip, 9.8, 9.9, 10.1, 9]  # the line is at 10.05 m over the valley
    assert len(tops(by_prominence(chm, CELL_M, CrownOptions()))) == trees
    assert len(tops(by_prominence(chm, CELL_M, CrownOptions(valley_share=0.0)))) == 2


def test_a_small_tree_at_the_flank_of_a_tall_one_needs_no_more_than_its_prominence() -> None:
    chm = np.zeros((3, 14))
    chm[1, 1:12] = [9, 10, 9.8, 12, 14, 16, 18, 16, 14, 12, 10]  # rises 0.2 m, 1.8 m below the line
    assert tops(by_prominence(chm, CELL_M, CrownOptions())) == {14 + 2, 14 + 7}
    assert tops(by_prominence(chm, CELL_M, CrownOptions(valley_share=0.75))) == {14 + 7}


def test_joined_crowns_are_the_highest_treetops() -> None:
    crowns = by_prominence(two_peaks(9.9), CELL_M, CrownOptions())
    assert tops(crowns) == {3 * 13 + 7}
    assert (crowns[3, 1:12] == 3 * 13 + 7).all()
    assert (np.delete(crowns, 3, axis=0) == -1).all()


def test_cells_go_to_the_treetop_that_they_climb_to() -> None:
    crowns = by_prominence(two_peaks(9.5), CELL_M, CrownOptions())
    assert crowns[3, 1:5].tolist() == [3 * 13 + 4] * 4
    assert crowns[3, 5:12].tolist() == [3 * 13 + 7] * 7


@pytest.mark.parametrize("method", sorted(METHODS))
def test_of_equal_treetops_that_touch_the_last_one_counts(method: str) -> None:
    chm = np.zeros((5, 6))
    chm[2, 1:5] = [8, 10, 10, 8]
    assert tops(METHODS[method](chm, CELL_M, CrownOptions())) == {2 * 6 + 3}


def test_of_equal_treetops_with_a_shallow_saddle_the_last_one_counts() -> None:
    chm = two_peaks(9.9, low=10.0, high=10.0)
    chm[3, 5:9] = 9.9, 9.95, 10.0, 9.5
    assert tops(by_prominence(chm, CELL_M, CrownOptions())) == {3 * 13 + 7}


def test_a_higher_treetop_far_away_takes_no_tree() -> None:
    chm = np.zeros((3, 40))
    chm[1] = 9.95
    chm[1, 3], chm[1, 36] = 10.0, 12.0  # 16.5 m apart on a plateau
    assert {43, 76} <= tops(by_prominence(chm, CELL_M, CrownOptions()))


@pytest.mark.parametrize("method", sorted(METHODS))
def test_a_crown_ends_at_its_reach(method: str) -> None:
    chm = np.zeros((3, 60))
    chm[1] = 20.0 - 0.2 * np.arange(60)
    crowns = METHODS[method](chm, CELL_M, CrownOptions(max_crown_radius_m=5.0, prominence_m=10.0))
    assert (crowns[1, :11] == 60).all()
    assert (crowns[1, 11:] == -1).all()


def test_low_canopy_is_no_crown() -> None:
    chm = np.zeros((3, 8))
    chm[1] = [10, 8, 6, 4, 2.1, 1.9, 1, 0.5]
    assert by_prominence(chm, CELL_M, CrownOptions())[1].tolist() == [8, 8, 8, 8, 8, -1, -1, -1]


@pytest.mark.parametrize("method", sorted(METHODS))
def test_the_rest_of_the_country_does_not_matter(method: str) -> None:
    chm = np.abs(np.random.default_rng(5).normal(12, 3, (60, 60)))
    part = chm[:50, :50]
    whole, cut = (METHODS[method](c, CELL_M, CrownOptions(max_crown_radius_m=3.0)) for c in (chm, part))
    inner = np.s_[:20, :20]
    assert (np.where(whole[inner] < 0, -1, whole[inner] // 60 * 50 + whole[inner] % 60) == cut[inner]).all()


def test_no_canopy_has_no_crowns() -> None:
    assert (by_prominence(np.zeros((4, 5)), CELL_M, CrownOptions()) == -1).all()
