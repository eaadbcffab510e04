"""The twenty parameters as the page shows them."""

import pytest

from pipeline.errors import UsageError
from pipeline.studio.modeller.parameters import PARAMETERS, changed, class_of, options_of, part_of
from pipeline.synthetic.colonization import ColonizationOptions

BY_NAME = {parameter.name: parameter for parameter in PARAMETERS}


def test_there_are_twenty_and_each_says_what_it_is():
    assert len(BY_NAME) == len(PARAMETERS) == 20
    assert all(parameter.sentence and parameter.label for parameter in PARAMETERS)


@pytest.mark.parametrize("parameter", PARAMETERS, ids=lambda parameter: parameter.name)
def test_every_end_of_a_slider_is_allowed(parameter):
    for value in parameter.choices or (parameter.low, parameter.high):
        typed = round(value) if parameter.whole else value
        beside = {"cutoff_bottom": 0.0} if parameter.name == "cutoff_top" else {"cutoff_top": 0.0}
        if parameter.name.startswith("cutoff") and value == 1:
            continue  # nothing would be left of the crown; the next test says so
        assert getattr(options_of({**beside, parameter.name: typed}), parameter.name) == typed


def test_two_cuts_that_leave_nothing_are_explained():
    with pytest.raises(UsageError, match="leave nothing of the crown; their sum must be below"):
        changed(ColonizationOptions(cutoff_top=0.5), cutoff_bottom=0.6)


def test_ranges_and_units_come_from_the_options():
    assert BY_NAME["iterations"][5:10] == (0, 100, 1, "", True)
    assert BY_NAME["crown_width_m"][5:10] == (1, 20, 0.1, "m", False)
    assert len(BY_NAME["leaf_colour"].choices) == 10


@pytest.mark.parametrize(
    ("name", "kind", "part"),
    [
        ("gnarliness", "growth", "growth"),
        ("seed", "growth", "growth"),
        ("stem_thickness", "geometry", "shape"),
        ("ring_sides", "geometry", "bark"),
        ("leaves_per_node", "geometry", "leaves"),
        ("leaf_type", "geometry", "leaves"),
        ("leaf_colour", "appearance", "appearance"),
        ("bark_picture", "appearance", "appearance"),
    ],
)
def test_classes(name, kind, part):
    assert (class_of(name), part_of(name)) == (kind, part)


def test_what_is_wrong_is_named_with_what_would_be_right():
    with pytest.raises(UsageError, match="unknown key gnarlines, do you mean gnarliness"):
        options_of({"gnarlines": 1})
    with pytest.raises(UsageError, match="gnarliness = 3 is not allowed; give a number >= 0"):
        options_of({"gnarliness": 3})
