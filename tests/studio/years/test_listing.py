"""Lists of events as files, and as people read them."""

import pytest

from pipeline.errors import InputFormatError, UsageError
from pipeline.growth.pruning import OPERATIONS
from pipeline.studio.years.forms import first_values, programme_from
from pipeline.studio.years.growing import Story
from pipeline.studio.years.listing import MOST_BYTES, read_programmes, row, written

CALIBRATED = """# Wood that the later acquisition lacks, proposed as cuts.
# 1.2 m of wood, 2.3 cm thick at the cut
[[event]]
year = 0
operation = "cut-to-bud"
position = [121913.2310, 487434.0020, 6.4000]
"""


@pytest.mark.parametrize("name", OPERATIONS)
def test_every_operation_is_written_and_read_back(plan, name):
    made = programme_from(name, first_values(name, 4, None) | {"until": "7", "every": "2"})
    story = Story(plan(programmes=(made,)), ())
    assert read_programmes(written(story), "events.toml") == (made,)


def test_the_same_event_twice_stays_two(plan, event):
    made = (event("open-centre", year=4), event("open-centre", year=4))
    assert read_programmes(written(Story(plan(programmes=made), ())), "x") == made


def test_what_calibrate_proposes_is_read():
    (made,) = read_programmes(CALIBRATED.encode(), "oak.events.toml")
    assert made.operation.position == (121913.231, 487434.002, 6.4)
    assert made.timing.year == 0


def test_what_does_not_fit_is_left_out_with_its_reason(grower, plan, event):
    lost = event("cut-to-bud", year=3, position="9, 9, 9")
    late = event("thin", year=5, until=20)
    story = grower.grow(plan(programmes=(lost, late, event("thin", year=12))), lambda _: None)
    text = written(story).decode()
    assert text.startswith("# left out: event of year 3, cut-to-bud: no branch is within")
    assert "# position = [9.0, 9.0, 9.0]" in text
    assert "# left out: it is after the 8 years" in text
    (kept,) = read_programmes(text.encode(), "x")
    assert (kept.timing.year, kept.timing.until) == (5, 8)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("alpha = 3", "alpha is not known here"),
        ("[[event]", "is not a file of events in TOML"),
        ("event = 3", "has tables"),
        ("#" * (MOST_BYTES + 1), "choose another"),
    ],
)
def test_other_files_are_refused_with_a_sentence(text, says):
    with pytest.raises(InputFormatError, match=f"odd.toml: .*{says}"):
        read_programmes(text.encode(), "odd.toml")


def test_a_wrong_event_is_named_with_its_number():
    text = '[[event]]\nyear = 1\noperation = "thin"\n[[event]]\nyear = 2\noperation = "thinn"'
    with pytest.raises(UsageError, match=r"mine\.toml: event 2: unknown operation 'thinn', do you mean thin"):
        read_programmes(text.encode(), "mine.toml")


def test_a_row_tells_when_what_and_what_came_of_it(grower, plan, event):
    made = plan(
        programmes=(
            event("limit-length", year=4, until=8, every=2, length_m=0.3),
            event("cut-to-bud", year=5, position="9, 9, 9"),
            event("thin", year=30),
        )
    )
    story = grower.grow(made, lambda _: None)
    rows = [row(one, number, story) for number, one in enumerate(made.programmes)]
    assert rows[0]["when"] == "4 to 8, every 2"
    assert rows[0]["told"] == "length_m 0.3"
    assert "cuts" in rows[0]["came"]
    assert "no branch is within 0.5 m" in rows[1]["wrong"]
    assert "add years" in rows[2]["wrong"]
    assert row(made.programmes[0], 0, None)["came"] == ""
