"""Undo and redo: whatever is done can be undone and done again."""

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from pipeline.studio.history import MOST, History

values = st.lists(st.integers(0, 5), max_size=30)
moves = st.lists(st.tuples(st.sampled_from(["record", "undo", "redo", "settled", "drag"]), st.integers(0, 5)))


def after(steps):
    history = History(0)
    for name, value in steps:
        if name == "record":
            history = history.record(value)
        elif name == "drag":
            history = history.record(value, "slider")
        else:
            history = getattr(history, name)()
    return history


@given(values)
def test_all_can_be_undone_and_done_again(given_values):
    history = last = after([("record", value) for value in given_values])
    while history.past:
        history = history.undo()
    assert history.present == 0
    while history.undone:
        history = history.redo()
    assert (history.present, history.past) == (last.present, last.past)


@given(moves)
def test_undo_then_redo_changes_nothing(steps):
    history = after(steps).settled()
    if history.past:
        assert history.undo().redo() == history
    if history.undone:
        assert history.redo().undo() == history


@given(moves)
def test_neighbours_in_the_past_differ(steps):
    history = after(steps).settled()
    line = [*history.past, history.present, *history.undone]
    assert all(a != b for a, b in pairwise(line))


def test_a_drag_is_one_step():
    history = History(0).record(1, "a").record(2, "a").record(3, "a")
    assert history.undo().present == 0
    assert history.settled().record(4, "a").undo().present == 3
    assert history.record(4, "b").undo().present == 3


def test_a_drag_that_ends_where_it_began_leaves_no_trace():
    history = History(0).record(1).record(2, "a").record(1, "a").settled()
    assert (history.present, history.past) == (1, (0,))


def test_a_new_value_forgets_what_was_undone():
    assert History(0).record(1).undo().record(2).redo().present == 2


def test_the_past_is_bounded():
    assert len(after([("record", k) for k in range(1, 2 * MOST)]).past) == MOST
