"""The Years tab in a real browser: grow, look at years, prune, edit, save, come back."""

import re

import pytest

from pipeline.exchange import read_model, write
from pipeline.studio.years.listing import read_programmes
from tests.studio.pages import (
    FIRST_MS,
    choose,
    close_menu,
    colours_drawn,
    comes_true,
    is_told,
    open_menu,
    picture,
    stands,
    until,
)

STEM = (794, 600)
"""Where the stem of the default tree stands in the window at first, in its year 20."""
EVENTS = '[[event]]\nyear = 12\noperation = "crown-raise"\nheight_m = 0.8\n'


@pytest.fixture(scope="module")
def folder(tmp_path_factory, standing):
    made = tmp_path_factory.mktemp("studio")
    write(standing, made / "oak.npz")
    return made


@pytest.fixture(scope="module")
def address(browser, served, folder):
    assert browser.is_connected()
    return served(folder)


@pytest.fixture
def page(visit, address):
    made = visit(address)
    made.click("#tab-years")
    has_grown(made)
    return made


def has_grown(page):
    """Wait until the years are there; the first ones compile."""
    page.wait_for_function("+document.querySelector('#years-figures')?.dataset.shown > 0", timeout=FIRST_MS)
    page.wait_for_selector("#years-stop", state="detached")


def figure(page, name):
    return page.inner_text(f"#years-figure-{name}")


def until_grown(page, act):
    """Do something, and wait until it has grown."""
    before = page.get_attribute("#years-figures", "data-shown")
    act()
    page.wait_for_function(f"document.querySelector('#years-figures').dataset.shown != '{before}'")


def turn_to(page, year):
    """Move the slider of years by the keyboard."""
    thumb = page.locator("#years-slider .v-slider-thumb")
    while int(figure(page, "year").split()[0]) != year:
        before = figure(page, "year")
        thumb.press("ArrowLeft" if int(before.split()[0]) > year else "ArrowRight")
        page.wait_for_function(f"document.querySelector('#years-figure-year').innerText != '{before}'")


def pick(page, place):
    """Click until a branch is picked: a browser that is busy may not have drawn the tree yet."""
    stands(page)
    picture(page)
    for _ in range(5):
        page.mouse.click(*place)
        if comes_true(page, page.locator("#years-branch").count, 20_000):
            return
    pytest.fail(f"nothing is picked at {place}")


def events(page):
    return [one.inner_text() for one in page.locator(".years-event").all()]


def test_years_are_looked_at_and_a_branch_is_pruned(page, tmp_path):
    metamers = {}
    for year in (25, 20):
        turn_to(page, year)
        metamers[year] = int(figure(page, "metamers").replace(",", ""))
    assert metamers[25] > metamers[20] > 100
    assert re.fullmatch(r"\d\.\d\d m", figure(page, "height"))
    pick(page, STEM)
    assert "The stem" in page.inner_text("#years-branch")
    assert "radii: allometric" in page.inner_text("#years-branch")
    place = page.input_value("#years-field-position")
    assert abs(float(place.split(",")[2]) - 1.05) < 0.3
    until_grown(page, lambda: page.click("#years-apply"))
    assert int(figure(page, "metamers").replace(",", "")) < metamers[20]
    assert "1 cut," in events(page)[0]

    page.click("#years-edit-0")
    page.wait_for_selector("#years-editing")
    page.fill("#years-field-year", "12")
    until_grown(page, lambda: page.click("#years-apply"))
    assert events(page)[0].startswith("12 · cut-to-bud")
    assert figure(page, "year") == "12 of 25"

    open_menu(page, "#years-files")
    with page.expect_download() as waiting:
        page.click("#years-save_events")
    waiting.value.save_as(tmp_path / "events.toml")
    (saved,) = read_programmes((tmp_path / "events.toml").read_bytes(), "events.toml")
    assert saved.timing.year == 12
    assert ", ".join(map(str, saved.operation.position)) == place
    with page.expect_download() as waiting:
        page.click("#years-export")
    assert waiting.value.suggested_filename == "bud-0-year012.ls.json"
    waiting.value.save_as(tmp_path / "tree.ls.json")
    assert len(read_model(tmp_path / "tree.ls.json")) == int(figure(page, "metamers").replace(",", "")) + 1
    close_menu(page)

    shown, listed = figure(page, "metamers"), events(page)
    page.reload()
    page.wait_for_selector("#years-event-0")
    assert (figure(page, "metamers"), events(page)) == (shown, listed)
    until_grown(page, lambda: page.click("#years-undo"))
    until_grown(page, lambda: page.click("#years-undo"))
    turn_to(page, 20)
    assert int(figure(page, "metamers").replace(",", "")) == metamers[20]
    assert events(page) == []


def test_an_event_that_does_not_fit_is_a_sentence(page):
    page.fill("#years-field-position", "30, 30, 30")
    until_grown(page, lambda: page.click("#years-apply"))
    is_told(page, "the nearest is")
    assert "no branch is within 0.5 m of (30.00, 30.00, 30.00)" in events(page)[0]
    until_grown(page, lambda: page.click("#years-remove-0"))
    assert events(page) == []


def test_what_is_typed_and_unfolded_stays_while_years_grow(page):
    page.click("#years-panel-growth .v-expansion-panel-title")
    page.fill("#years-field-position", "1, 2, 3")
    vigour = page.locator("#years-set-alpha .v-slider-thumb")
    vigour.wait_for()
    for act in (lambda: vigour.press("ArrowRight"), lambda: page.click("#years-undo")):
        until_grown(page, act)
        assert page.input_value("#years-field-position") == "1, 2, 3"
        assert vigour.is_visible()
    page.click("#years-panel-growth .v-expansion-panel-title")
    page.fill("#years-field-position", "")


def test_years_out_of_range_are_explained_until_they_are_put_right(page):
    held = page.input_value("#years-span")
    page.fill("#years-span", "99999")
    is_told(page, "a tree cannot grow for 99999 years; give 0 to 1000")
    page.fill("#years-span", held)
    page.wait_for_selector("#trouble", state="detached")


def test_events_are_opened_or_explained(page, tmp_path):
    (tmp_path / "odd.toml").write_text('[[event]]\nyear = 3\noperation = "crown-rise"')
    (tmp_path / "good.toml").write_text(EVENTS)
    open_menu(page, "#years-files")
    page.set_input_files("#years-open-events", tmp_path / "odd.toml")
    is_told(page, "do you mean crown-raise")
    until_grown(page, lambda: page.set_input_files("#years-open-events", tmp_path / "good.toml"))
    close_menu(page)
    assert events(page)[0].startswith("12 · crown-raise")
    until_grown(page, lambda: page.click("#years-undo"))


def test_a_model_of_the_folder_grows_on_and_a_long_growth_is_stopped(page, standing):
    until_grown(page, lambda: choose(page, "#years-file", "oak.npz"))
    assert figure(page, "year") == "10 of 10"
    turn_to(page, 9)
    assert int(figure(page, "metamers").replace(",", "")) > len(standing)
    until(page, lambda: colours_drawn(page) > 300)
    page.fill("#years-span", "1000")
    page.wait_for_selector("#years-stop")
    page.wait_for_function("/year [1-9]/.test(document.querySelector('#years-doing')?.innerText)")
    page.click("#years-stop")
    page.wait_for_function("/stopped/.test(document.querySelector('#years-doing')?.innerText)")
    until_grown(page, lambda: page.click("#years-undo"))
    assert figure(page, "year") == "9 of 10"
    until_grown(page, lambda: page.click("#years-bud"))
    assert figure(page, "year") == "25 of 25"


def test_a_model_and_its_events_are_opened_by_the_command(visit, served, folder):
    (folder / "oak.events.toml").write_text(EVENTS.replace("12", "2"))
    page = visit(served(folder / "oak.npz", folder / "oak.events.toml"))
    has_grown(page)
    assert figure(page, "year") == "10 of 10"
    assert events(page)[0].startswith("2 · crown-raise")
    until(page, lambda: colours_drawn(page) > 300)
