"""From a plan to years: the same as in one go, whatever was kept of the plan before."""

from typing import ClassVar

import numpy as np
import pytest

from pipeline.errors import UsageError
from pipeline.growth import GrowthOptions
from pipeline.growth.carrying import Carrying, through
from pipeline.growth.events import Programme, Timing
from pipeline.growth.pruning import Operation
from pipeline.studio.years import growing
from pipeline.studio.years.growing import Grower, copied, first_changed
from pipeline.studio.years.plan import Start


def quiet(_story):
    pass


def in_one_go(plan):
    """Grow a plan as `treepipe simulate` does."""
    growth = Carrying(plan.start.tree, plan.options, seed=plan.seed)
    for _ in through(growth, plan.years, [one for held in plan.programmes for one in held.events()]):
        pass
    return growth.to_model()


def same(one, other):
    return all(
        np.array_equal(a, b)
        for a, b in (
            (one.skeleton.xyz, other.skeleton.xyz),
            (one.skeleton.parent, other.skeleton.parent),
            (one.radius, other.radius),
            (one.radius_source, other.radius_source),
        )
    )


def test_every_year_is_kept_and_the_last_is_that_of_one_go(grower, plan):
    told = []
    story = grower.grow(plan(), told.append)
    assert [year.number for year in story.years] == list(range(9))
    assert [len(step.years) for step in told] == list(range(1, 10))
    assert story.whole
    assert not told[3].whole
    assert same(story.years[-1].tree, in_one_go(plan()))
    assert story.years[0].report is None
    assert story.years[8].report.metamers == len(story.years[8].limbs.width) - 1


@pytest.mark.parametrize("light", ["shadow", "space"])
def test_a_pruning_grows_only_later_years_again_and_to_the_same_bits(grower, plan, event, light):
    before = plan(options=GrowthOptions(light=light), years=9)
    first = grower.grow(before, quiet)
    after = before.adding([event("cut-to-bud", year=6, order=0, length_m=0.4)])
    story = grower.grow(after, quiet)
    assert story.again == 6
    assert story.years[5] is first.years[5]
    assert story.years[6].done[0].entry.removed > 0
    assert same(story.years[-1].tree, in_one_go(after))
    undone = grower.grow(before, quiet)
    assert undone.again == 6
    assert same(undone.years[-1].tree, first.years[-1].tree)


def test_a_standing_tree_grows_on_to_the_same_bits(grower, plan, event, standing):
    before = plan(start=Start("oak", standing), years=4)
    grower.grow(before, quiet)
    after = before.adding([event("crown-raise", year=2, height_m=0.6), event("thin", year=3)])
    story = grower.grow(after, quiet)
    assert story.again == 2
    assert same(story.years[-1].tree, in_one_go(after))
    assert np.array_equal(story.years[0].tree.skeleton.xyz, standing.skeleton.xyz)


def test_nothing_is_grown_for_the_same_plan_and_little_for_more_years(grower, plan):
    first = grower.grow(plan(), quiet)
    again = grower.grow(plan(), quiet)
    assert all(a is b for a, b in zip(first.years, again.years, strict=True))
    fewer = grower.grow(plan(years=5), quiet)
    assert [year.number for year in fewer.years] == [0, 1, 2, 3, 4, 5]
    more = grower.grow(plan(years=10), quiet)
    assert more.years[8] is first.years[8]
    assert more.again == 9


@pytest.mark.parametrize("change", [{"seed": 5}, {"species": "apple"}, {"options": GrowthOptions(alpha=2.5)}])
def test_another_seed_species_or_parameter_grows_all_again(plan, change):
    assert first_changed(plan(), plan(**change), 9) == 0


def test_a_stopped_growth_keeps_its_years(grower, plan):
    class StopError(Exception):
        pass

    def stop(story):
        if len(story.years) == 4:
            raise StopError

    with pytest.raises(StopError):
        grower.grow(plan(), stop)
    story = grower.grow(plan(), quiet)
    assert story.again == 4
    assert same(story.years[-1].tree, in_one_go(plan()))


def test_an_event_that_does_not_fit_names_the_nearest_and_leaves_the_tree(grower, plan, event):
    made = plan(programmes=(event("cut-to-bud", year=3, until=6, position="9, 9, 9"), event("thin", year=8)))
    story = grower.grow(made, quiet)
    year, sentence = story.misfits()[0]
    assert year == 3
    assert "no branch is within 0.5 m of (9.00, 9.00, 9.00); the nearest is" in sentence
    assert story.years[4].done[0].entry is None
    assert 1 not in story.misfits()
    assert story.whole
    fits = plan(programmes=(event("thin", year=8),))
    assert same(story.years[-1].tree, in_one_go(fits))


class Half(Operation):
    """Cuts, and then finds that it cannot."""

    name: ClassVar[str] = "half"
    about: ClassVar[str] = "cut half"

    def _act(self, growth):
        growth.remove(int(growth.metamers.axis()[3]))
        msg = "half is cut; the rest is too hard"
        raise UsageError(msg)


def test_an_event_that_fails_halfway_leaves_no_trace(grower, plan):
    story = grower.grow(plan(programmes=(Programme(Timing(year=6), Half()),)), quiet)
    assert story.misfits()[0] == (6, "event of year 6, half: half is cut; the rest is too hard")
    assert same(story.years[-1].tree, in_one_go(plan()))


def test_states_that_were_given_up_are_grown_again_to_the_same_bits(grower, plan, event, monkeypatch):
    monkeypatch.setattr(growing, "MOST_BYTES", 1)
    before = plan(programmes=(event("crown-raise", year=4, height_m=0.4),))
    grower.grow(before, quiet)
    after = before.adding([event("thin", year=7)])
    story = grower.grow(after, quiet)
    assert story.again == 7
    assert same(story.years[-1].tree, in_one_go(after))


def test_too_large_a_tree_ends_the_growth_with_a_sentence(grower, plan, monkeypatch):
    monkeypatch.setattr(growing, "MOST_METAMERS", 20)
    story = grower.grow(plan(years=20), quiet)
    assert "more than this page shows" in story.ended
    assert story.whole
    assert 1 < len(story.years) < 20
    limited = Grower(lambda: 0.0).grow(plan(options=GrowthOptions(most_metamers=10), years=20), quiet)
    assert "raise it, grow for fewer years" in limited.ended


def test_a_copy_goes_on_by_itself(standing):
    growth = Carrying(standing, GrowthOptions(), seed=1)
    growth.grow_year()
    other = copied(growth)
    count = len(growth.metamers)
    other.grow_year()
    assert len(growth.metamers) == count
    growth.grow_year()
    assert same(growth.to_model(), other.to_model())
    assert other.tree is growth.tree
