"""Options as fields: ranges, steps, and what a form gives."""

import pytest

from pipeline.config import Config
from pipeline.errors import UsageError
from pipeline.studio.scan.fields import FIELDS, STEPS, TABLES, changed, reset, values_of

BY_KEY = {field.key: field for field in FIELDS}


def test_every_option_of_a_reconstruction_has_a_field():
    assert set(BY_KEY) == {f"{table}.{name}" for table, kind in TABLES.items() for name in kind.model_fields}
    assert len({field.state for field in FIELDS}) == len(FIELDS)


@pytest.mark.parametrize("field", FIELDS, ids=lambda field: field.key)
def test_a_field_says_what_it_is_and_its_default_can_be_given_back(field):
    assert field.sentence.strip()
    shown = field.shown(field.default)
    assert changed(Config(), field.key, shown) == Config()


@pytest.mark.parametrize("field", [field for field in FIELDS if field.slides], ids=lambda field: field.key)
def test_every_step_of_a_slider_is_allowed(field):
    values = [field.value_at(step) for step in range(0, STEPS + 1, 50)]
    assert values == sorted(values)
    assert (values[0], values[-1]) == (pytest.approx(field.low, rel=0.01, abs=1e-9), field.high)
    for value in values:
        try:
            config = changed(Config(), field.key, value)
        except UsageError as error:  # two options of the colony depend on each other, which is said
            assert field.name in {"colony_kill", "colony_influence"}
            assert "is not below" in str(error)  # noqa: PT017
            continue
        assert getattr(getattr(config, field.table), field.name) == value
    if field.low < field.default < field.high:  # small values have room
        assert values[2] <= field.default <= values[-4]


def test_texts_of_a_form_are_read():
    assert changed(Config(), "clean.voxel_m", " 0,02 ").clean.voxel_m == 0.02
    assert changed(Config(), "clean.outlier_neighbours", 9.0).clean.outlier_neighbours == 9
    assert changed(Config(), "skeleton.insertion_deg", "30, 40").skeleton.insertion_deg == (30.0, 40.0)
    assert changed(Config(), "clean.find_ground", given=False).clean.find_ground is False


@pytest.mark.parametrize(
    ("key", "given", "says"),
    [
        ("clean.voxel_m", 7, "voxel_m = 7 is not allowed; give a number >= 0.001"),
        ("clean.voxel_m", "", "is not allowed; give a number"),
        ("clean.outlier_neighbours", 2.5, "give a whole number"),
        ("skeleton.method", "magic", 'give one of "auto"'),
        ("skeleton.insertion_deg", "steep", "give a list of numbers"),
        ("lsystem.radii", "all", "no option of a reconstruction"),
        ("clean.voxel", 1, "no option of a reconstruction"),
    ],
)
def test_what_is_not_allowed_is_explained(key, given, says):
    with pytest.raises(UsageError, match=says):
        changed(Config(), key, given)


def test_only_the_options_of_the_method_in_use_need_to_be_shown():
    assert BY_KEY["skeleton.slice_m"].methods == ("geodesic",)
    assert BY_KEY["skeleton.method"].methods == ()
    assert "greedy" in BY_KEY["skeleton.direction_window_m"].methods
    assert BY_KEY["skeleton.method"].key == next(field.key for field in FIELDS if field.table == "skeleton")


def test_reset_leaves_how_files_are_written():
    config = changed(Config().with_settings(["lsystem.radii=all"]), "clean.voxel_m", 0.1)
    again = reset(config, Config())
    assert again.clean == Config().clean
    assert again.lsystem.radii == "all"
    assert values_of(again)["scan_clean_voxel_m"] == 0.005
