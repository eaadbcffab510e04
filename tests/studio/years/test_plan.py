"""Plans: what changes with what, and where an event goes."""

import pytest

from pipeline.errors import UsageError
from pipeline.growth import GrowthOptions
from pipeline.growth.species import species_named
from pipeline.studio.years.plan import YEARS_ON, Plan, Start, species_choices


def years_of(plan):
    return [one.timing.year for one in plan.programmes]


def test_events_stand_in_the_order_of_their_years(plan, event):
    made = plan().adding([event("thin", year=5), event("thin", year=2), event("outward", year=5, all=True)])
    assert years_of(made) == [2, 5, 5]
    assert [one.operation.name for one in made.programmes] == ["thin", "thin", "outward"]


def test_another_year_moves_an_event_and_other_values_do_not(plan, event):
    made = plan().adding([event("thin", year=2), event("thin", year=4), event("thin", year=6)])
    assert years_of(made.changing(0, event("thin", year=5))) == [4, 5, 6]
    other = made.changing(1, event("thin", year=4, share=0.1))
    assert other.programmes[1].operation.share == 0.1


def test_events_are_left_out_and_change_places(plan, event):
    made = plan().adding([event("thin", year=2), event("outward", year=2, all=True)])
    assert [one.operation.name for one in made.moved(1, -1).programmes] == ["outward", "thin"]
    assert made.moved(0, -1) == made
    assert len(made.without(0).programmes) == 1
    with pytest.raises(UsageError, match="no event 3 in a list of 2"):
        made.without(2)


def test_due_are_the_events_of_a_year_in_the_order_of_the_list(plan, event):
    made = plan(programmes=(event("thin", year=1, until=7, every=3), event("outward", year=4, all=True)))
    assert [made.due(year) for year in (1, 2, 4, 7)] == [(0,), (), (0, 1), (0,)]


def test_a_species_brings_its_parameters_and_none_the_defaults(plan):
    made = plan().of_species("poplar")
    assert made.species == "poplar"
    assert made.options.alpha == species_named("poplar")["alpha"]
    assert made.of_species("").options == GrowthOptions()
    assert set(species_choices()) >= {"", "poplar", "apple"}
    with pytest.raises(UsageError, match="do you mean poplar"):
        plan().of_species("popler")


def test_another_tree_begins_without_events(plan, event, standing):
    made = plan(programmes=(event("thin", year=2),)).from_start(Start("oak", standing))
    assert made.programmes == ()
    assert made.years == YEARS_ON
    assert not made.start.is_bud
    assert Plan().start.is_bud


@pytest.mark.parametrize(
    ("values", "says"),
    [({"years": 5000}, "give 0 to 1000"), ({"years": -1}, "give 0"), ({"seed": -2}, "seed -2")],
)
def test_years_and_seed_have_bounds(plan, values, says):
    with pytest.raises(UsageError, match=says):
        plan().with_(**values)


def test_a_parameter_out_of_range_is_explained(plan):
    with pytest.raises(UsageError, match=r"alpha = 0\.0 is not allowed"):
        plan().with_options(alpha=0.0)


def test_years_reach_to_the_first_time_of_every_event(plan, event):
    assert plan().adding([event("thin", year=30, until=40)]).long_enough().years == 30
