"""Modelling: what a change makes anew, and what it leaves as it is."""

import numpy as np
import pytest

from pipeline.errors import InputFormatError
from pipeline.formats.png import packed
from pipeline.studio.modeller.modelling import ENDED, MOST_SHOWN, Modeller, envelope
from pipeline.studio.modeller.parameters import changed
from pipeline.studio.modeller.pictures import MOST_PX, picture
from pipeline.synthetic.colonization import ColonizationOptions, dressed, grow_colonization

SMALL = ColonizationOptions(iterations=8, crown_width_m=2, crown_height_m=3, crown_depth_m=2)
LONG = ColonizationOptions(
    iterations=100, crown_width_m=12, crown_height_m=12, crown_depth_m=12, density_begin=0.5
)


class Ticks:
    """A clock that goes on by a second whenever it is read."""

    def __init__(self):
        self.now = 0.0

    def __call__(self):
        """Tell the time."""
        self.now += 1.0
        return self.now


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
    grown = any(not isinstance(step, str) for step in steps)
    assert same | (set() if grown else {"growth"}) == kept
    assert modeller.model(SMALL).wood is first.wood


def test_the_crown_shows_some_of_its_points():
    points = envelope(LONG)
    assert MOST_SHOWN / 2 < len(points) <= MOST_SHOWN
    assert np.ptp(points[:, 0]) == pytest.approx(2 * 12, rel=0.1)


def test_every_step_is_told_and_can_be_the_last():
    modeller, steps = Modeller(Ticks()), []

    def until_drawn(step):
        steps.append(step)
        if isinstance(step, str) and "bark" in step:
            raise StopIteration

    with pytest.raises(StopIteration):
        modeller.model(SMALL, until_drawn)
    grown = [step for step in steps if not isinstance(step, str)]
    whole = modeller.model(SMALL).tree
    assert [step.nodes for step in grown] == [len(step.xyz) for step in grown]
    assert all((step.parent[1:] < np.arange(1, step.nodes)).all() for step in grown)
    assert grown[-1].nodes == len(whole)
    assert np.array_equal(grown[0].xyz, grown[-1].xyz[: grown[0].nodes])
    assert steps[len(grown) :] == [f"shaping {len(whole)} nodes", f"drawing the bark of {len(whole)} nodes"]


def test_pictures_are_made_small_and_explained_where_they_are_none(tmp_path):
    (tmp_path / "wide.png").write_bytes(packed(np.zeros((4, 3 * MOST_PX, 3), dtype=np.uint8)))
    assert picture(str(tmp_path / "wide.png")).shape[1:] == (MOST_PX, 4)
    assert picture("") is None
    (tmp_path / "odd.png").write_text("none")
    with pytest.raises(InputFormatError, match="is no PNG picture"):
        Modeller(Ticks()).model(changed(SMALL, leaf_picture=str(tmp_path / "odd.png")))
