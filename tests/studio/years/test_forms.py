"""Operations as fields to fill in."""

import numpy as np
import pytest

from pipeline.errors import UsageError
from pipeline.growth.pruning import OPERATIONS
from pipeline.studio.years.forms import fields_of, first_values, operations, programme_from, values_of


def test_all_eleven_operations_are_offered():
    assert [one["value"] for one in operations()] == list(OPERATIONS)
    assert len(operations()) == 11
    assert all(one["about"] for one in operations())


@pytest.mark.parametrize("name", OPERATIONS)
def test_the_fields_hold_every_parameter_and_give_the_event_back(name):
    fields = fields_of(name)
    assert {field["name"] for field in fields} == {"year", "until", "every", *OPERATIONS[name].model_fields}
    assert all(field["sentence"] for field in fields)
    made = programme_from(name, first_values(name, 7, np.array([1.23456, -0.0001, 2.0])))
    assert made.timing.year == 7
    assert programme_from(name, values_of(made)) == made
    if "position" in OPERATIONS[name].model_fields:
        assert made.operation.position == (1.235, 0.0, 2.0)


def test_values_are_read_as_people_write_them():
    made = programme_from(
        "stake", {"year": "3", "direction": "[1, 0 , 0.5]", "weight": " 1.5 ", "years": "", "position": None}
    )
    assert made.operation.direction == (1.0, 0.0, 0.5)
    assert made.operation.weight == 1.5
    assert made.operation.years is None
    assert programme_from("thin", {"year": 3.0, "all": True}).timing.year == 3


@pytest.mark.parametrize(
    ("operation", "values", "says"),
    [
        ("thin", {"year": "soon"}, "year: 'soon' is no number; give year after whose growth"),
        ("thin", {"year": ""}, "year is missing"),
        ("thin", {"year": "2", "share": "0.9"}, "share = 0.9 is not allowed"),
        ("stake", {"year": "2", "direction": "1, 2"}, "direction"),
        ("reduce", {"year": "2", "width_m": "2"}, "height_m is missing"),
        ("prune", {"year": "2"}, "unknown operation 'prune'"),
        ("stake", {"year": "2", "direction": "0,0,0"}, "a direction of no length"),
    ],
)
def test_what_is_wrong_is_said(operation, values, says):
    with pytest.raises(UsageError, match=says):
        programme_from(operation, values)
