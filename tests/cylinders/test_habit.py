"""What a tree's own branches teach of the radius for the length they carry, and where they teach nothing."""

from types import SimpleNamespace

import numpy as np
import pytest

import pipeline
from pipeline.cylinders.habit import CARRIED_M, expected_square
from pipeline.synthetic import TlsOptions, TubeTreeOptions, grow_tubes, scan, step_for, truth_of

STEM = 0.01  # squared radius of a stem of 10 cm, square metres
CARRIED = np.concatenate([[400.0, 300.0], np.geomspace(0.1, 100.0, 800)])
AXES = SimpleNamespace(first=np.array([0, 2, len(CARRIED)]))


def squares(slope):
    return 2e-5 * (CARRIED + CARRIED_M) ** slope


def taught(square, known):
    return expected_square(AXES, square, known, CARRIED, STEM)


@pytest.mark.parametrize("slope", [0.5, 0.8, 1.2])
def test_the_trees_own_line_is_found(slope):
    found = taught(squares(slope), np.ones(len(CARRIED), dtype=bool))
    np.testing.assert_allclose(found, squares(slope), rtol=0.2)


def test_a_class_of_which_few_nodes_are_seen_does_not_teach():
    """In sparse clouds the few windows on twigs are those that hold points of other branches."""
    square, known = squares(0.8), np.ones(len(CARRIED), dtype=bool)
    twigs = CARRIED < 3.0
    known[twigs] = np.arange(twigs.sum()) % 4 == 0
    square[twigs] = 0.02**2
    found = taught(square, known)
    np.testing.assert_allclose(found[~twigs][2:], squares(0.8)[~twigs][2:], rtol=0.2)
    assert np.sqrt(found[twigs]).max() < 0.01


def test_a_slope_from_few_classes_leans_on_the_pipe_model():
    square, known = np.full(len(CARRIED), 0.03**2), CARRIED > 20.0
    found = taught(square, known)
    assert np.sqrt(found[2]) < 0.01  # a flat line would make twigs of 3 cm
    np.testing.assert_allclose(np.sqrt(found[-1]), 0.03, rtol=0.35)


def test_without_measured_branches_the_pipe_model_shares_the_stem_out():
    found = taught(squares(0.8), np.zeros(len(CARRIED), dtype=bool))
    np.testing.assert_allclose(found, STEM * (CARRIED + CARRIED_M) / (CARRIED[0] + CARRIED_M))


def test_branches_in_a_cloud_of_points_3_cm_apart_are_not_too_thick():
    grown = grow_tubes(TubeTreeOptions(seed=21, height_m=8, trunk_radius_m=0.12))
    scanner = TlsOptions(step_deg=step_for(300, TlsOptions().distance_m), noise_m=0.003, seed=21)
    tree = pipeline.reconstruct(scan(grown, options=scanner).cloud)
    is_stem = tree.skeleton.branch == 0
    truth = truth_of(grown)
    length = np.linalg.norm(truth.e - truth.s, axis=1)
    branches = float((np.pi * truth.r**2 * length)[truth.order > 0].sum())
    assert 0.6 * branches < float(tree.volume[~is_stem].sum()) < 1.4 * branches
