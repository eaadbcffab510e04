"""Files of events: read, written, replayed to the byte, and refused with the remedy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.errors import InputFormatError, InputMissingError, UsageError
from pipeline.growth import GrowthOptions, grow
from pipeline.growth.carrying import Carrying
from pipeline.growth.events import planned, read_events, write_events
from pipeline.growth.lost import Cut
from pipeline.growth.pruning import BendAndTie, CrownRaise, CutToBud, FacingBud, Pruned, Reduce, Stake, Thin
from pipeline.jobs.calibration import event_table
from pipeline.model import Skeleton, TreeModel

TABLES = """\
[[event]]
year = 0
operation = "stake"
years = 6
direction = [0.0, 0.5, 1.0]

[[event]]
year = 5
operation = "open-centre"

[[event]]
year = 6
until = 10
every = 2
operation = "crown-raise"
height_m = 0.35

[[event]]
year = 9
operation = "thin"
share = 0.15
"""


@pytest.fixture
def written(tmp_path):
    """Return a function that writes a file of events and returns its path."""

    def write(text):
        path = tmp_path / "events.toml"
        path.write_text(text, encoding="utf-8")
        return path

    return write


def test_a_file_is_read_and_written_back_as_it_was(written, tmp_path) -> None:
    events = read_events(written(TABLES))
    assert [event.year for event in events] == [0, 5, 6, 8, 10, 9]
    write_events(events, tmp_path / "again.toml")
    assert (tmp_path / "again.toml").read_text(encoding="utf-8") == TABLES
    assert read_events(tmp_path / "again.toml") == events


def test_a_file_replays_to_the_same_bytes(written, tmp_path) -> None:
    events = read_events(written(TABLES))
    write_events(events, tmp_path / "again.toml")
    first = grow(GrowthOptions(), 12, seed=4, events=events)
    second = grow(GrowthOptions(), 12, seed=4, events=read_events(tmp_path / "again.toml"))
    one, other = first.to_model(), second.to_model()
    assert one.skeleton.xyz.tobytes() == other.skeleton.xyz.tobytes()
    assert one.radius.tobytes() == other.radius.tobytes()
    done = [(entry.year, entry.operation) for entry in first.log if isinstance(entry, Pruned)]
    raised = [(year, "crown-raise") for year in (6, 8, 10)]
    assert done == [(0, "stake"), (5, "open-centre"), *raised[:2], (9, "thin"), raised[2]]
    assert one.skeleton.xyz.tobytes() != grow(GrowthOptions(), 12, seed=4).to_model().skeleton.xyz.tobytes()


numbers = st.floats(-50, 50, allow_nan=False)
operations = st.one_of(
    st.builds(CutToBud, position=st.tuples(numbers, numbers, numbers)),
    st.builds(
        Reduce, shape=st.sampled_from(["box", "cylinder"]), width_m=st.floats(0.1, 99), height_m=st.just(3.0)
    ),
    st.builds(Thin, share=st.floats(0.01, 0.5), azimuth_deg=st.none() | st.floats(-360, 360)),
    st.builds(BendAndTie, all=st.booleans(), direction=st.none() | st.just((1.0, 0.0, 0.0))),
)


@given(operations, st.integers(0, 40), st.integers(0, 20), st.integers(1, 5))
def test_any_programme_survives_the_file(tmp_path_factory, operation, year, more, every) -> None:
    events = planned(operation, year, until=year + more, every=every)
    path = tmp_path_factory.mktemp("events") / "events.toml"
    write_events(events, path)
    assert read_events(path) == events
    assert {event.programme.operation for event in events} == {operation}


@pytest.mark.parametrize(
    ("text", "error", "told"),
    [
        ('year = 3\noperation = "crownraise"', UsageError, "event 1: unknown operation .* mean crown-raise"),
        ('year = 3\noperation = "thin"\nshar = 0.1', UsageError, "thin: unknown key shar, do you mean share"),
        ('year = 3\nevry = 2\noperation = "thin"', UsageError, "thin: unknown key evry, do you mean every"),
        ('yaer = 3\noperation = "thin"', UsageError, "thin: unknown key yaer, do you mean year"),
        ('year = 3\noperation = "thin"\nshare = 0.9', UsageError, "share = 0.9 is not allowed"),
        ('year = -1\noperation = "thin"', UsageError, "year = -1 is not possible; give a whole"),
        ('year = 2000\noperation = "thin"', UsageError, "year = 2000 is not possible"),
        ('year = 3\nuntil = 2\noperation = "thin"', UsageError, "until, 2, is before year, 3; give"),
        ('operation = "thin"', UsageError, "year is missing; give the year"),
        ("year = 3", UsageError, "operation is missing; give for example"),
        ("year = ", InputFormatError, "is not a file of events in TOML"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_told_with_the_file_and_the_remedy(written, text, error, told) -> None:
    path = written(f"[[event]]\n{text}\n")
    with pytest.raises(error, match=told) as caught:
        read_events(path)
    assert str(path) in str(caught.value)


def test_a_file_of_something_else_is_refused(written, tmp_path) -> None:
    with pytest.raises(UsageError, match=r"alpha is not known here; .* tables \[\[event\]\]"):
        read_events(written("alpha = 2.2\n"))
    with pytest.raises(InputMissingError, match="there is no such file"):
        read_events(tmp_path / "none.toml")
    assert read_events(written("")) == ()


def test_an_error_while_it_grows_names_the_event() -> None:
    events = planned(CutToBud(position=(0, 0, 9)), 3)
    with pytest.raises(
        UsageError, match=r"event of year 3, cut-to-bud: no branch is within 0\.5 m .* nearest is"
    ):
        grow(GrowthOptions(), 4, seed=0, events=events)
    with pytest.raises(UsageError, match=r"event of year 9 in 4 years .* give years"):
        grow(GrowthOptions(), 4, seed=0, events=planned(Stake(), 9))


def test_a_repeated_event_waits_for_its_branches_and_a_single_one_does_not() -> None:
    growth = grow(GrowthOptions(), 6, seed=0, events=planned(FacingBud(order=7), 1, until=6))
    assert [entry.idle for entry in growth.log if isinstance(entry, Pruned)] == [True] * 6
    with pytest.raises(
        UsageError,
        match=r"event of year 3, facing-bud: no branch fits order = 7; the nearest is of order 1",
    ):
        grow(GrowthOptions(), 4, seed=0, events=planned(FacingBud(order=7), 3))


def test_positions_are_in_the_coordinates_of_a_reconstructed_tree() -> None:
    grown = grow(GrowthOptions(), 10, seed=1).to_model()
    origin = np.array([120_000.0, 480_000.0, 10.0])
    graph = Skeleton(grown.skeleton.xyz, grown.skeleton.parent, origin)
    tree = TreeModel(graph, grown.radius, grown.radius_source, grown.radius_rmse)
    growth = Carrying(tree, GrowthOptions(), seed=1)
    tip = graph.world[graph.paths[2][-1]]
    done = planned(CutToBud(position=tuple(tip), within_m=0.02), 0)[0].apply(growth)
    assert (done.cuts, done.removed) == (1, 1)
    assert len(growth.to_model()) == len(tree) - 1
    with pytest.raises(UsageError, match=r"nearest is \d+\.\d\d m away, at \(1\d{5}\.\d\d, 4\d{5}\.\d\d"):
        CutToBud(position=(0, 0, 0)).apply(growth)


def test_a_crown_stays_raised_year_after_year() -> None:
    events = planned(CrownRaise(height_m=0.5), 4, until=14)
    growth = grow(GrowthOptions(), 14, seed=2, events=events)
    held = growth.metamers.held()
    assert held["begin"][held["order"] > 0, 2].min() >= 0.5 - 1e-9


def test_proposed_cuts_of_a_calibration_are_events(written) -> None:
    cut = Cut(year=2, position=np.array([0.1, 0.0, 1.2]), diameter_m=0.05, length_m=3.0)
    event = read_events(written(event_table(cut, np.array([1000.0, 2000.0, 3.0]))))[0]
    assert event.year == 2
    assert event.programme.operation == CutToBud(position=(1000.1, 2000.0, 4.2))
