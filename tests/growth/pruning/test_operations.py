"""What every operation keeps, and what is wrong to ask for."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from pipeline.cli.prune import ABOUT
from pipeline.errors import UsageError
from pipeline.growth import GrowthOptions, grow
from pipeline.growth.events import read_events
from pipeline.growth.pruning import OPERATIONS, CutToBud, Pruned, Selector, operation_of
from tests.growth.pruning.conftest import check_whole

PAGE = Path(__file__).parents[3] / "docs" / "pruning.md"
EXAMPLES = {
    "cut-to-bud": {"order": 0, "length_m": 0.6},
    "facing-bud": {"order": 1},
    "outward": {"all": True},
    "stake": {"direction": (1, 0, 1)},
    "open-centre": {},
    "espalier": {"tiers": 2},
    "limit-length": {"length_m": 0.3},
    "crown-raise": {"height_m": 0.4},
    "thin": {"share": 0.3, "largest": 0.2},
    "reduce": {"width_m": 0.8, "height_m": 1.2},
    "bend-and-tie": {"order": 1, "lowest_m": 0.2},
}


def test_every_operation_has_its_example_and_its_line_of_help() -> None:
    assert list(EXAMPLES) == list(OPERATIONS)
    assert {name: operation.about for name, operation in OPERATIONS.items()} == ABOUT
    for operation in OPERATIONS.values():
        assert all(field.description for field in operation.model_fields.values())


def test_the_page_tells_every_parameter() -> None:
    page = PAGE.read_text(encoding="utf-8")
    for name, operation in OPERATIONS.items():
        for key, field in operation.model_fields.items():
            if key in Selector.model_fields:
                assert f"`{key}" in page, key
            else:
                row = next(line for line in page.splitlines() if line.startswith(f"| {name} | `{key}` |"))
                assert row.endswith(f"| {field.description} |")


@pytest.mark.parametrize(
    "text", re.findall(r"```toml\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
)
def test_the_examples_of_the_page_are_events(text, tmp_path) -> None:
    path = tmp_path / "events.toml"
    path.write_text(text, encoding="utf-8")
    assert read_events(path)


@pytest.mark.parametrize("name", ["cut-to-bud", "limit-length", "thin", "bend-and-tie"])
def test_free_space_is_given_back_too(name) -> None:
    growth = grow(GrowthOptions(light="space"), 8, seed=2)
    more = {"lowest_m": 0.5} if name == "bend-and-tie" else {}
    assert not operation_of(name, EXAMPLES[name] | more).apply(growth).idle
    check_whole(growth)


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_tree_stays_whole_and_the_light_fits_it(name, tree) -> None:
    before = tree.metamers.count
    done = operation_of(name, EXAMPLES[name]).apply(tree)
    assert not done.idle
    assert done is tree.log[-1]
    assert isinstance(done, Pruned)
    assert (done.year, done.operation) == (tree.year, name)
    assert done.removed == before - tree.metamers.count
    check_whole(tree)
    tree.grow_year()
    check_whole(tree)


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_same_seed_gives_the_same_bytes(name, tree_of) -> None:
    trees = [tree_of(8) for _ in range(2)]
    for one in trees:
        operation_of(name, EXAMPLES[name]).apply(one)
        one.grow_year()
    for key, array in trees[0].metamers.held().items():
        assert array.tobytes() == trees[1].metamers.held()[key].tobytes(), key


@pytest.mark.parametrize("name", sorted(set(EXAMPLES) - {"bend-and-tie", "espalier"}))
def test_what_stays_has_not_moved_and_cut_buds_never_grow_again(name, tree) -> None:
    before = {
        key: tuple(end) for key, end in zip(*(tree.metamers.held()[k] for k in ("key", "end")), strict=True)
    }
    operation_of(name, EXAMPLES[name]).apply(tree)
    after = {
        key: tuple(end) for key, end in zip(*(tree.metamers.held()[k] for k in ("key", "end")), strict=True)
    }
    assert after.items() <= before.items()
    gone = before.keys() - after.keys()
    for _ in range(3):
        tree.grow_year()
    assert not gone & set(tree.metamers.held()["key"].tolist())


@pytest.mark.parametrize(
    ("name", "values", "text"),
    [
        ("thinn", {}, "unknown operation 'thinn', do you mean thin\\? known: cut-to-bud, "),
        ("crown-raise", {"hight_m": 2}, "crown-raise: unknown key hight_m, do you mean height_m\\?"),
        ("crown-raise", {"height_m": 2, "hight_m": 2}, "unknown key hight_m, do you mean height_m\\?"),
        ("crown-raise", {}, "crown-raise: height_m is missing; give a number .*: clear height"),
        ("crown-raise", {"height_m": 51}, "height_m = 51 is not allowed; give a number .* <= 50"),
        ("thin", {"share": 0.0}, "share = 0.0 is not allowed"),
        ("stake", {"direction": (0, 0, 0)}, "direction of no length .* give for example"),
        ("bend-and-tie", {"direction": (0, 0, 0)}, "direction of no length"),
        ("reduce", {"width_m": 1, "height_m": 1, "shape": "cone"}, "shape = 'cone' is not allowed"),
        ("espalier", {"tiers": 0}, "tiers = 0 is not allowed"),
    ],
)  # fmt: skip
def test_wrong_parameters_are_named_with_what_is_right(name, values, text) -> None:
    with pytest.raises(UsageError, match=text):
        operation_of(name, values)


def test_a_position_without_a_branch_names_the_nearest_and_its_distance(tree) -> None:
    place = tree.metamers.end[tree.metamers.axis(0)[-1]] + [0.0, 0.0, 2.0]
    with pytest.raises(UsageError, match=r"no branch is within 0\.5 m of .* nearest is 2\.00 m away, at \("):
        CutToBud(position=tuple(place)).apply(tree)


@pytest.mark.parametrize("values", [{"order": 0}, {"position": (0, 0, 0.01)}, {"order": 0, "length_m": 0.05}])
def test_no_cut_goes_through_the_foot(values, tree) -> None:
    count = tree.metamers.count
    with pytest.raises(UsageError, match=r"goes through the foot .* cut higher up"):
        CutToBud(**values).apply(tree)
    assert tree.metamers.count == count


def test_what_needs_a_branch_asks_for_it(tree) -> None:
    with pytest.raises(UsageError, match=r"facing-bud must know which branches .* or all = true"):
        operation_of("facing-bud", {}).apply(tree)


def test_selectors_choose_by_order_height_azimuth_and_all(tree) -> None:
    held = tree.metamers.held()
    sides = np.flatnonzero(held["is_lateral"])
    assert CutToBud(order=0).starts(tree).tolist() == [0]
    np.testing.assert_array_equal(CutToBud(all=True).starts(tree), sides)
    np.testing.assert_array_equal(CutToBud(order=2).starts(tree), sides[held["order"][sides] == 2])
    low, high = CutToBud(order=1, highest_m=0.4).starts(tree), CutToBud(order=1, lowest_m=0.4001).starts(tree)
    assert len(low)
    assert len(high)
    assert held["begin"][low, 2].max() <= 0.4 < held["begin"][high, 2].min()
    np.testing.assert_array_equal(np.sort(np.concatenate([low, high])), CutToBud(order=1).starts(tree))
    quarters = [CutToBud(order=1, azimuth_deg=a).starts(tree).tolist() for a in (0, 90, 180, -90)]
    assert (
        sorted(start for quarter in quarters for start in quarter) == CutToBud(order=1).starts(tree).tolist()
    )
    for start in quarters[0]:
        step = held["end"][tree.metamers.axis(start)[-1]] - held["begin"][start]
        assert step[0] >= abs(step[1])


def test_a_position_chooses_the_axis_there(tree) -> None:
    held = tree.metamers.held()
    for start in np.flatnonzero(held["is_lateral"])[:5].tolist():
        tip = tree.metamers.axis(start)[-1]
        assert CutToBud(position=tuple(held["end"][tip]), within_m=0.01).starts(tree).tolist() == [start]
