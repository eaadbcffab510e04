"""Modelling: what a change makes anew, and what it leaves as it is; the worker behind the page."""

from threading import Event

import numpy as np
import pytest

from pipeline.studio.modelling import ENDED, MOST_SHOWN, Modeller, envelope
from pipeline.studio.parameters import changed
from pipeline.studio.worker import Worker
from pipeline.synthetic.colonization import ColonizationOptions, dressed, grow_colonization

SMALL = ColonizationOptions(iterations=8, crown_width_m=2, crown_height_m=3, crown_depth_m=2)
LONG = ColonizationOptions(
    iterations=100, crown_width_m=12, crown_height_m=12, crown_depth_m=12, density_begin=0.5
)
PATIENCE_S = 30


class Ticks:
    """A clock that goes on by a second whenever it is read."""

    def __init__(self):
        self.now = 0.0

    def __call__(self):
        """Tell the time."""
        self.now += 1.0
        return self.now


class Watcher:
    """Keeps what the worker tells, and lets a test wait for it."""

    def __init__(self):
        self.made, self.sentences, self.steps, self.stops = [], [], [], 0
        self.begun, self.over = Event(), Event()

    def begins(self, options):
        """Keep nothing."""

    def growing(self, progress):
        """Keep a step."""
        self.steps.append(progress)
        self.begun.set()

    def done(self, modelled):
        """Keep a tree."""
        self.made.append(modelled)
        self.over.set()

    def stopped(self):
        """Count a stop."""
        self.stops += 1
        self.over.set()

    def failed(self, sentence):
        """Keep a sentence."""
        self.sentences.append(sentence)
        self.over.set()


@pytest.fixture
def watcher():
    return Watcher()


@pytest.fixture
def worker(watcher):
    made = Worker(Modeller(Ticks()), watcher, gather_s=0.001)
    yield made
    made.close()


def test_a_model_is_that_of_the_command_line():
    modelled = Modeller(Ticks()).model(SMALL)
    tree = grow_colonization(SMALL)
    drawn = dressed(tree, SMALL)
    assert np.array_equal(modelled.tree.skeleton.xyz, tree.skeleton.xyz)
    assert np.array_equal(modelled.mesh().vertices, drawn.vertices)
    assert (modelled.vertices, modelled.triangles) == (len(drawn.vertices), len(drawn.faces))
    assert modelled.milliseconds == 1000
    assert modelled.reason in ENDED


@pytest.mark.parametrize(
    ("change", "kept"),
    [
        ({"leaf_colour": "red"}, {"growth", "tree", "wood", "foliage"}),
        ({"leaf_size_m": 0.3}, {"growth", "tree", "wood"}),
        ({"ring_sides": 5}, {"growth", "tree", "foliage"}),
        ({"stem_thickness": 0.9}, {"growth"}),
        ({"gnarliness": 0.2}, set()),
        ({"seed": 7}, set()),
    ],
)
def test_a_change_makes_anew_only_what_depends_on_it(change, kept):
    modeller, steps = Modeller(Ticks()), []
    first = modeller.model(SMALL)
    second = modeller.model(changed(SMALL, **change), steps.append)
    same = {part for part in ("tree", "wood", "foliage") if getattr(first, part) is getattr(second, part)}
    assert same | (set() if steps else {"growth"}) == kept
    assert modeller.model(SMALL).wood is first.wood


def test_the_crown_shows_some_of_its_points():
    points = envelope(LONG)
    assert MOST_SHOWN / 2 < len(points) <= MOST_SHOWN
    assert np.ptp(points[:, 0]) == pytest.approx(2 * 12, rel=0.1)


def test_the_worker_makes_what_is_wanted_and_tells_how_far_it_is(worker, watcher):
    worker.ask(SMALL)
    assert watcher.over.wait(PATIENCE_S)
    assert [made.options for made in watcher.made] == [SMALL]
    assert [step.done for step in watcher.steps] == list(range(1, len(watcher.steps) + 1))


def test_a_newer_wish_overtakes_a_long_growth(worker, watcher):
    worker.ask(LONG)
    assert watcher.begun.wait(PATIENCE_S)
    worker.ask(SMALL)
    assert watcher.over.wait(PATIENCE_S)
    assert [made.options for made in watcher.made] == [SMALL]


def test_a_long_growth_can_be_stopped_and_the_worker_lives_on(worker, watcher):
    worker.ask(LONG)
    assert watcher.begun.wait(PATIENCE_S)
    worker.stop()
    assert watcher.over.wait(PATIENCE_S)
    assert (watcher.stops, watcher.made) == (1, [])
    watcher.over.clear()
    worker.ask(SMALL)
    assert watcher.over.wait(PATIENCE_S)
    assert len(watcher.made) == 1


def test_what_cannot_be_made_is_a_sentence(watcher):
    class Broken(Modeller):
        def model(self, options, progress=None):
            del options, progress
            raise MemoryError

    worker = Worker(Broken(Ticks()), watcher, gather_s=0.001)
    worker.ask(SMALL)
    assert watcher.over.wait(PATIENCE_S)
    assert watcher.sentences == ["this tree does not fit into memory; make the crown smaller"]
    worker.close()
