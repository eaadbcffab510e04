"""A sitting with the years: what a person does, without a browser."""

import numpy as np
import pytest

from pipeline.errors import OutputExistsError, UsageError
from pipeline.growth import GrowthOptions
from pipeline.studio.folders import Folders
from pipeline.studio.years.session import Session

CAMERA = {
    "position": [0.0, -8.0, 0.5],
    "focalPoint": [0.0, 0.0, 0.5],
    "viewUp": [0.0, 0.0, 1.0],
    "viewAngle": 30,
}


@pytest.fixture
def sitting(plan, grower, tmp_path):
    """A session whose years have grown, and what grows them again."""
    session = Session(Folders([tmp_path]), plan())

    def grow():
        session.tell(grower.grow(session.plan, lambda _: None))
        return session

    session.grow = grow
    return grow()


def test_everything_is_undone_and_redone(sitting, standing_file, standing, tmp_path):
    sitting.folders = Folders([tmp_path, standing_file])
    steps = [
        lambda: sitting.set("years", 9),
        lambda: sitting.set("alpha", 2.4),
        sitting.new_seed,
        lambda: sitting.species("apple"),
        lambda: sitting.add("thin", {"year": "3"}),
        lambda: sitting.change(0, "thin", {"year": "4"}),
        lambda: sitting.remove(0),
        lambda: sitting.open_events(b'[[event]]\nyear = 12\noperation = "thin"', "x.toml"),
        lambda: sitting.open_parameters(b"alpha = 3.0", "y.toml"),
        lambda: sitting.begin_with(standing, "model"),
        lambda: sitting.begin_with_file(standing_file),
        sitting.begin_with_bud,
    ]
    plans = [sitting.plan]
    for step in steps:
        step()
        sitting.settle()
        plans.append(sitting.plan)
    assert len({id(plan) for plan in plans}) == len(steps) + 1
    for plan in plans[-2::-1]:
        sitting.undo()
        assert sitting.plan is plan
    for plan in plans[1:]:
        sitting.redo()
        assert sitting.plan is plan


def test_a_drag_is_one_step(sitting):
    for value in (2.3, 2.4, 2.5):
        sitting.set("alpha", value)
    sitting.settle()
    sitting.undo()
    assert sitting.plan.options == GrowthOptions()


def test_what_is_wrong_changes_nothing(sitting):
    before = sitting.plan
    for act in (
        lambda: sitting.set("alpha", -1.0),
        lambda: sitting.set("years", 10_000),
        lambda: sitting.add("thin", {"year": "x"}),
        lambda: sitting.change(3, "thin", {"year": "1"}),
        lambda: sitting.begin_with(None, "model"),
    ):
        with pytest.raises(UsageError):
            act()
    assert sitting.plan is before


def test_the_slider_shows_each_year_and_the_last_at_first(sitting):
    assert sitting.year.number == 8
    sitting.look_at(3)
    assert sitting.year.number == 3
    sitting.look_at(80)
    assert sitting.year.number == 8


def test_a_branch_is_picked_pruned_and_its_event_edited(sitting):
    sitting.look_at(6)
    branch = sitting.pick(CAMERA, (400, 330), (800, 600))
    assert branch.order == 0
    assert np.allclose(sitting.place, branch.place)
    position = ", ".join(f"{value:.3f}" for value in sitting.place)
    sitting.add("cut-to-bud", {"year": "6", "position": position})
    before = len(sitting.year.limbs.width)
    sitting.grow()
    assert sitting.branch is None
    assert sitting.year.number == 6
    assert len(sitting.year.limbs.width) < before
    assert "1 cut," in sitting.rows()[0]["came"]
    sitting.change(0, "cut-to-bud", {"year": "6", "position": "5, 5, 5"})
    assert sitting.rows()[0]["came"] == ""
    sitting.grow()
    assert "the nearest is" in sitting.rows()[0]["wrong"]
    assert len(sitting.year.limbs.width) == before


def test_what_is_picked_stays_while_its_year_is_the_same(sitting):
    sitting.look_at(4)
    assert sitting.pick(CAMERA, (400, 330), (800, 600)) is not None
    sitting.add("thin", {"year": "7"})
    sitting.grow()
    assert sitting.branch is not None
    sitting.look_at(5)
    assert sitting.branch is None
    assert sitting.pick(CAMERA, (1, 1), (800, 600)) is None


def test_a_picked_place_is_in_the_coordinates_of_the_tree(sitting, standing):
    sitting.begin_with(standing, "model")
    sitting.grow()
    sitting.look_at(0)
    sitting.pick(CAMERA, (400, 330), (800, 600))
    assert np.allclose(sitting.place[:2], standing.skeleton.origin[:2], atol=0.2)


def test_events_wait_until_it_is_known_whether_they_fit(sitting):
    sitting.add("thin", {"year": "7"})
    with pytest.raises(UsageError, match="the years still grow"):
        sitting.saved_events()
    sitting.grow()
    assert b"thin" in sitting.saved_events()


def test_an_event_beyond_the_years_lengthens_them(sitting):
    sitting.add("thin", {"year": "12"})
    assert sitting.plan.years == 12


def test_results_are_saved_in_the_folder_but_not_over_others(sitting, standing, tmp_path):
    sitting.begin_with(standing, "model")
    sitting.grow()
    assert sorted(path.name for path in sitting.save()) == [
        "model-3-start.npz",
        "model-3.events.toml",
        "model-3.growth.toml",
    ]
    with pytest.raises(OutputExistsError, match="give another name"):
        sitting.save()
    assert len(list(tmp_path.iterdir())) == 3
