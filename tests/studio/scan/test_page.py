"""The Scan tab in a real browser without a window: what a person does, and what they see of it."""

import shutil
import tomllib

import pytest

from pipeline.exchange import read_model
from tests.studio.pages import (
    FIRST_MS,
    camera,
    choose,
    close_menu,
    colours_drawn,
    is_told,
    open_menu,
    stands,
    until,
)

TREE = {"x": 340, "y": 120, "width": 590, "height": 400}
"""Where the tree stands in the window: neither the panel nor the legend."""
FIELD = "document.querySelector('.v-input:has(#scan-open)')"


@pytest.fixture(scope="module")
def place(folder, tmp_path_factory):
    """A folder of its own, for what is saved."""
    made = tmp_path_factory.mktemp("page")
    shutil.copytree(folder, made, dirs_exist_ok=True)
    return made


@pytest.fixture(scope="module")
def address(served, place):
    return served(place / "twig.laz")


@pytest.fixture
def page(visit, address):
    page = visit(address)
    page.wait_for_function("+document.querySelector('#scan-line')?.dataset.shown > 0", timeout=FIRST_MS)
    at_rest(page)
    return page


def at_rest(page):
    page.wait_for_function("!document.querySelector('#scan-stop')", timeout=FIRST_MS)


def figure(page, key):
    return page.inner_text(f"[id='scan-figure-{key}']")


def until_shown(page, act):
    """Do something, and wait until another result is shown."""
    before = page.get_attribute("#scan-line", "data-shown")
    act()
    page.wait_for_function(
        f"document.querySelector('#scan-line').dataset.shown != '{before}'", timeout=FIRST_MS
    )
    at_rest(page)


def set_option(page, table, name, value):
    """Type the value of an option."""
    if not page.is_visible(f"#scan-set-{table}-{name}"):
        page.click(f"#scan-table-{table} .v-expansion-panel-title")
    field = page.locator(f"#scan-set-{table}-{name} .v-field input")
    field.fill(value)
    field.press("Enter")


def colours_of(page):
    """Count the colours of the tree."""
    return colours_drawn(page, TREE)


def test_a_cloud_is_reconstructed_and_shown_in_layers_and_colours(page):
    assert page.inner_text("#scan-report").startswith("twig")
    assert figure(page, "height_m").endswith(" m")
    assert " to " in figure(page, "dbh_cm")
    assert "points are drawn" in page.inner_text("#scan-line")
    assert "Height above the ground" in page.inner_text("#scan-legends")
    until(page, lambda: colours_of(page) > 100)
    full = colours_of(page)
    for name in ("cloud", "axes", "wood"):
        page.click(f"#scan-show-{name}")
    until(page, lambda: colours_of(page) < full / 2)
    for name in ("cloud", "axes", "wood"):
        page.click(f"#scan-show-{name}")
    for words, says in (
        ("Branch order", "1st order"),
        ("Where radii", "% of the length"),
        ("Distance", "wood without points"),
    ):
        choose(page, "#scan-mode", words)
        page.wait_for_function(f"document.querySelector('#scan-legends')?.innerText.includes('{says}')")
    assert "mm" in page.inner_text("#scan-legends")
    until(page, lambda: colours_of(page) > full / 2)
    choose(page, "#scan-mode", "Height")


def test_options_change_the_figures_and_are_undone(page):
    before = figure(page, "points_used"), figure(page, "nodes")
    until_shown(page, lambda: set_option(page, "clean", "voxel_m", "0.03"))
    after = figure(page, "points_used"), figure(page, "nodes")
    assert after != before
    assert "made: clean, skeleton, fit" in page.inner_text("#scan-line")
    until_shown(page, lambda: page.click("#scan-do-undo"))
    assert (figure(page, "points_used"), figure(page, "nodes")) == before
    until_shown(page, lambda: page.click("#scan-do-redo"))
    assert (figure(page, "points_used"), figure(page, "nodes")) == after
    until_shown(page, lambda: page.click("#scan-do-reset"))
    page.click("#scan-table-cylinders .v-expansion-panel-title")
    slider = page.locator("#scan-set-cylinders-step_m .v-slider-thumb")
    slider.wait_for()
    until_shown(page, lambda: slider.press("PageUp"))
    assert "made: fit; kept: clean, skeleton" in page.inner_text("#scan-line")
    assert float(page.input_value("#scan-set-cylinders-step_m .v-field input")) > 0.04
    until_shown(page, lambda: page.click("#scan-do-reset"))
    set_option(page, "clean", "voxel_m", "7")
    is_told(page, "voxel_m = 7 is not allowed; give a number >= 0.001")
    assert page.input_value("#scan-set-clean-voxel_m .v-field input") == "0.005"


def test_what_is_known_beside_the_points_is_given(page):
    until_shown(page, lambda: choose(page, "#scan-ground", "floor.laz"))
    page.fill("#scan-crs", "RD")
    page.press("#scan-crs", "Enter")
    is_told(page, "RD: is not of the form EPSG:N")
    page.fill("#scan-crs", "EPSG:28992")
    until_shown(page, lambda: page.press("#scan-crs", "Enter"))
    assert figure(page, "crs") == "EPSG:28992"
    open_menu(page, "#scan-files")
    said = page.locator("#scan-command").text_content()  # whether or not the menu has faded in
    assert "--ground" in said
    assert "--crs EPSG:28992" in said
    close_menu(page)
    until_shown(page, lambda: (page.fill("#scan-crs", ""), page.press("#scan-crs", "Enter")))
    until_shown(page, lambda: choose(page, "#scan-ground", "in the cloud, or found"))


def test_models_are_compared_and_downloaded(page, tmp_path):
    until_shown(page, lambda: choose(page, "#scan-against", "twig.truth.npz"))
    assert "B: twig.truth.npz" in page.inner_text("#scan-tables")
    assert "bark of A from B's" in page.inner_text("#scan-tables")
    assert "the other one (B)" in page.inner_text("#scan-legends")
    stands(page)
    place, _ = camera(page)
    page.click("#scan-side")
    until(page, lambda: abs(camera(page)[0] - place).max() > 0.1)  # where both are seen
    page.wait_for_function("!document.querySelector('#scan-legends')?.innerText.includes('the other one')")
    page.click("#scan-over")
    until_shown(page, lambda: choose(page, "#scan-against", "nothing"))
    page.wait_for_selector("#scan-tables", state="detached")
    page.click("#scan-show-cloud")  # the comparison has switched it off
    open_menu(page, "#scan-files")
    with page.expect_download() as waiting:
        page.click("#scan-save")
    assert waiting.value.suggested_filename == "twig.toml"
    waiting.value.save_as(tmp_path / "twig.toml")
    assert tomllib.loads((tmp_path / "twig.toml").read_text())["clean"]["voxel_m"] == 0.005
    with page.expect_download(timeout=FIRST_MS) as waiting:
        page.click("#scan-download")
    waiting.value.save_as(tmp_path / waiting.value.suggested_filename)
    assert f"{len(read_model(tmp_path / 'twig.ls.json')):,}" == figure(page, "nodes")


def test_the_page_survives_what_is_no_tree_stopping_and_loading_again(page):
    before = figure(page, "nodes")
    for name, says in (("empty.laz", "is empty (0 bytes)"), ("three.xyz", "needs at least 10")):
        choose(page, "#scan-open", name)
        page.wait_for_function(
            f"document.querySelector('#trouble')?.innerText.includes('{says}')", timeout=FIRST_MS
        )
        at_rest(page)
        assert figure(page, "nodes") == before
        page.wait_for_function(
            f"[{FIELD}.innerText, {FIELD}.querySelector('input').value].join().includes('twig.laz')"
        )
    until_shown(page, lambda: choose(page, "#scan-open", "model: twig.truth.npz"))
    assert figure(page, "nodes") != before
    until_shown(page, lambda: choose(page, "#scan-open", "cloud: twig.laz"))
    set_option(page, "cylinders", "step_m", "0.001")
    page.click("#scan-stop")
    page.wait_for_function("/stopped/.test(document.querySelector('#scan-doing')?.innerText)")
    assert figure(page, "nodes") == before
    until_shown(page, lambda: page.click("#scan-do-undo"))
    page.reload()
    page.wait_for_function("+document.querySelector('#scan-line')?.dataset.shown > 0")
    assert figure(page, "nodes") == before
