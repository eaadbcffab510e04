"""The page in a real browser without a window: what a person does, and what they see of it."""

import socket
from itertools import pairwise

import numpy as np
import pytest

from pipeline.exchange import read_model
from pipeline.formats.png import packed
from pipeline.studio.folders import Folders
from pipeline.studio.modeller.files import open_parameters
from tests.studio.pages import (
    camera,
    close_menu,
    colours_drawn,
    is_told,
    look,
    open_menu,
    picture,
    stands,
    until,
)

START = "seed = 7\niterations = 20\n"
LONG, LONGEST = (
    "seed = 7\niterations = 100\ndensity_begin = 0.6\n"
    + "".join(f"crown_{side}_m = {half}\n" for side in ("width", "height", "depth"))
    for half in (11, 16)
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("studio")
    (made / "start.toml").write_text(START)
    return made


@pytest.fixture(scope="module")
def address(browser, served, folder):
    assert browser.is_connected()
    return served(folder / "start.toml")


@pytest.fixture
def page(visit, address):
    made = visit(address)
    made.wait_for_function("+document.querySelector('#figures')?.dataset.shown > 0")
    made.wait_for_function("!document.querySelector('#stop')")
    return made


def figures(page):
    return {name: page.inner_text(f"#figure-{name}") for name in ("nodes", "vertices", "triangles", "seed")}


def until_shown(page, act):
    """Do something, and wait until another tree is shown."""
    before = page.get_attribute("#figures", "data-shown")
    act()
    page.wait_for_function(f"document.querySelector('#figures').dataset.shown != '{before}'")
    page.wait_for_function("!document.querySelector('#stop')")


def press(page, name, key="ArrowLeft"):
    """Move a slider by the keyboard."""
    until_shown(page, lambda: page.locator(f"#set-{name} .v-slider-thumb").press(key))


def click(page, name):
    until_shown(page, lambda: page.click(f"#do-{name}"))


def test_a_tree_with_leaves_is_there_at_the_start(page):
    shown = figures(page)
    assert shown["seed"] == "7"
    assert int(shown["triangles"].replace(",", "")) > int(shown["nodes"].replace(",", "")) > 100
    assert "ended: " in page.inner_text("#figure-reason")
    until(page, lambda: colours_drawn(page) > 500)


def test_a_slider_changes_the_figures_and_undo_takes_it_back(page):
    before = figures(page)
    press(page, "gnarliness")
    after = figures(page)
    assert after["nodes"] != before["nodes"]
    click(page, "undo")
    assert figures(page) == before
    click(page, "redo")
    assert figures(page) == after
    click(page, "undo")


def test_a_new_seed_keeps_the_parameters_and_is_undone(page):
    before = figures(page)
    click(page, "seed")
    assert figures(page)["seed"] != before["seed"]
    assert page.inner_text("#set-iterations").split()[-1] == "20"
    click(page, "undo")
    assert figures(page) == before


def test_presets_and_reset(page):
    before = figures(page)
    open_menu(page, "#examples")
    until_shown(page, lambda: page.click("#preset-bush"))
    assert figures(page)["seed"] == "7"
    assert page.inner_text("#set-stem_length_m").split()[-2:] == ["0", "m"]
    click(page, "reset")
    assert page.inner_text("#set-iterations").split()[-1] == "30"
    click(page, "undo")
    click(page, "undo")
    assert figures(page) == before


def test_the_page_can_be_loaded_again(page):
    press(page, "stem_thickness")
    before, thickness = figures(page), page.inner_text("#set-stem_thickness")
    page.reload()
    page.wait_for_function("+document.querySelector('#figures')?.dataset.shown > 0")
    assert figures(page) == before
    assert page.inner_text("#set-stem_thickness") == thickness
    click(page, "undo")
    until(page, lambda: colours_drawn(page) > 500)


def test_what_is_downloaded_can_be_read(page, tmp_path):
    open_menu(page, "#files")
    with page.expect_download() as waiting:
        page.click("#save-parameters")
    waiting.value.save_as(tmp_path / "mine.toml")
    options = open_parameters(tmp_path / "mine.toml", Folders([tmp_path]))
    assert (options.seed, options.iterations) == (7, 20)
    with page.expect_download() as waiting:
        page.click("#download")
    assert waiting.value.suggested_filename == "tree-7.obj.zip"
    waiting.value.save_as(tmp_path / "tree.zip")
    assert (tmp_path / "tree.zip").read_bytes()[:2] == b"PK"


def test_a_model_is_saved_into_the_folder_but_not_over_another(page, folder):
    open_menu(page, "#files")
    page.fill("#save-name", "oak.ls.json")
    page.click("#save")
    page.wait_for_selector("#good")
    assert f"{len(read_model(folder / 'oak.ls.json')):,}" == figures(page)["nodes"]
    page.click("#save")
    is_told(page, "exists already; give another name")


def test_parameter_files_are_opened_or_explained(page, tmp_path):
    (tmp_path / "odd.toml").write_text("iterations = 1000")
    (tmp_path / "huge.toml").write_text("#" * 200_000)
    (tmp_path / "good.toml").write_text("seed = 11\niterations = 12")
    before = figures(page)
    for name, says in (("odd", "iterations = 1000 is not allowed"), ("huge", "choose a parameter file")):
        open_menu(page, "#files")
        page.set_input_files("#open-parameters", tmp_path / f"{name}.toml")
        is_told(page, says)
        close_menu(page)
        page.reload()
        page.wait_for_selector("#figures")
    assert figures(page) == before
    open_menu(page, "#files")
    until_shown(page, lambda: page.set_input_files("#open-parameters", tmp_path / "good.toml"))
    assert figures(page)["seed"] == "11"
    close_menu(page)
    click(page, "undo")
    assert figures(page) == before


def test_keys_undo_and_redo_but_not_where_text_is_typed(page):
    before = figures(page)
    click(page, "seed")
    after = figures(page)
    until_shown(page, lambda: page.keyboard.press("Control+z"))
    assert figures(page) == before
    until_shown(page, lambda: page.keyboard.press("Control+Shift+z"))
    assert figures(page) == after
    until_shown(page, lambda: page.keyboard.press("Control+z"))
    until_shown(page, lambda: page.keyboard.press("Control+y"))
    open_menu(page, "#files")
    page.fill("#save-name", "mine.obj")
    page.keyboard.press("Control+z")
    page.wait_for_function("document.querySelector('#save-name').value != 'mine.obj'")
    close_menu(page)
    page.locator("#do-fit").focus()
    until_shown(page, lambda: page.keyboard.press("Control+z"))
    assert figures(page) == before  # the one step back, which the key above has not taken
    until_shown(page, lambda: page.keyboard.press("Control+y"))
    assert figures(page) == after
    click(page, "undo")


def grow_long(page, tmp_path, parameters=LONG):
    """Open parameters of a tree that takes its time, and wait until twigs are shown."""
    (tmp_path / "long.toml").write_text(parameters)
    open_menu(page, "#files")
    page.set_input_files("#open-parameters", tmp_path / "long.toml")
    page.wait_for_function("/growing: iteration/.test(document.querySelector('#doing')?.innerText)")
    close_menu(page)


def leaves_drawn(page):
    """Count the pixels that are green."""
    red, green, blue = np.moveaxis(look(page).astype(int), 2, 0)
    return int(((green > red + 15) & (green > blue + 15)).sum())


def leaves_at_rest(page):
    """Count them once the tree is drawn whole."""
    until(page, lambda: leaves_drawn(page) > 1000)
    picture(page)
    return leaves_drawn(page)


def test_a_long_growth_shows_its_twigs_and_can_be_stopped(page, tmp_path):
    before = figures(page)
    green = leaves_at_rest(page)
    grow_long(page, tmp_path, LONGEST)
    until(page, lambda: leaves_drawn(page) < green / 50)
    page.click("#stop")
    page.wait_for_function("/stopped/.test(document.querySelector('#doing')?.innerText)")
    assert figures(page) == before
    until(page, lambda: leaves_drawn(page) > 0.9 * green)
    until_shown(page, lambda: page.click("#do-undo"))
    assert figures(page) == before


def test_a_browser_that_loads_again_in_the_middle_sees_the_growth_go_on(page, tmp_path):
    before = figures(page)
    grow_long(page, tmp_path)
    page.reload()
    seen = "document.querySelector('#figure-nodes')?.innerText"
    page.wait_for_function(f"{seen} && {seen} != '{before['nodes']}'")
    page.wait_for_selector("#stop", state="detached")
    click(page, "undo")
    assert figures(page) == before


def test_a_browser_that_closes_in_the_middle_leaves_a_server(visit, address, page, tmp_path):
    other = visit(address)
    grow_long(other, tmp_path, LONG.replace("seed = 7", "seed = 8"))
    other.close()
    click(page, "undo")
    assert figures(page)["seed"] == "7"


def test_two_browsers_show_one_tree(visit, address, page):
    other = visit(address)
    until_shown(other, lambda: click(page, "seed"))
    assert figures(other) == figures(page)
    until_shown(page, lambda: click(other, "undo"))
    assert figures(other) == figures(page)
    for each in (page, other):
        until(each, lambda each=each: colours_drawn(each) > 500)


def test_a_tree_that_cannot_be_made_is_a_sentence_on_the_page_and_in_the_log(page, folder, served):
    before = figures(page)
    (folder / "odd.png").write_text("no picture")
    (folder / "odd.toml").write_text(f"seed = 7\niterations = 20\nleaf_picture = '{folder / 'odd.png'}'")
    open_menu(page, "#files")
    page.set_input_files("#open-parameters", folder / "odd.toml")
    is_told(page, "odd.png: is no PNG picture; save it as PNG")
    said = page.inner_text("#trouble")
    assert f"treepipe: {said}" in served.log.read_text()
    close_menu(page)
    click(page, "undo")
    assert figures(page) == before
    assert not page.query_selector("#trouble")


def test_pictures_of_ones_own_are_drawn(page, folder):
    open_menu(page, "#files")
    for name, colour in (("bark", (250, 0, 250)), ("leaf", (0, 250, 250))):
        (folder / f"{name}.png").write_bytes(packed(np.full((8, 8, 3), colour, dtype=np.uint8)))
    named = "".join(f"{name}_picture = '{folder / name}.png'\n" for name in ("bark", "leaf"))
    (folder / "mine.toml").write_text(f"{START}{named}")
    until_shown(page, lambda: page.set_input_files("#open-parameters", folder / "mine.toml"))
    close_menu(page)

    def drawn(channel):
        shot = look(page).astype(int)
        others = np.delete(shot, channel, axis=2)
        return int((others.min(axis=2) > shot[:, :, channel] + 40).sum())

    until(page, lambda: drawn(0) > 1000)
    until(page, lambda: drawn(1) > 100)
    click(page, "undo")
    until(page, lambda: drawn(0) == drawn(1) == 0)


def test_a_port_in_use_is_a_sentence(studio):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        with studio("--port", taken.getsockname()[1]) as server:
            _, said = server.communicate(timeout=60)
    assert server.returncode == 1
    assert "give another one with --port" in said
    assert "Traceback" not in said


def drag(page, end, key=None, button="left"):
    """Drag from the picture's middle as a hand does: the view overlooks the first move after a rest."""
    page.mouse.move(800, 400)
    if key:
        page.keyboard.down(key)
    page.mouse.down(button=button)
    for share in (0.25, 0.5, 0.75, 1.0):
        page.mouse.move(800 + share * (end[0] - 800), 400 + share * (end[1] - 400))
        page.wait_for_timeout(50)
    page.mouse.up(button=button)
    if key:
        page.keyboard.up(key)


def seen_from(page, act, as_told):
    """Do something until the camera has changed as it should: a slow browser may gather a drag into one move.

    ``as_told`` is told how far the camera went along its line of sight, and across it, metres; and whether it
    still looks at the same point.
    """

    def is_seen():
        place, middle = camera(page)
        act()
        now, aim = camera(page)
        sight = (middle - place) / np.linalg.norm(middle - place)
        along = float((now - place) @ sight)
        across = float(np.linalg.norm(now - place - along * sight))
        return as_told(along, across, np.allclose(middle, aim))

    until(page, is_seen)
    picture(page)


def turned(_along, across, same_aim):
    """Tell whether it goes around what it looks at."""
    return same_aim and across > 0.1


def moved(along, across, same_aim):
    """Tell whether it goes aside, and looks past what it looked at."""
    return not same_aim and across > 0.1 and abs(along) < 1e-6


def zoomed(along, across, _same_aim):
    """Tell whether it goes to or fro."""
    return abs(along) > 0.1 and across < 1e-6


def test_the_tree_is_seen_from_all_sides_and_fitted_again(page):
    leaves_at_rest(page)
    stands(page)
    page.mouse.move(800, 400)
    shots = [picture(page)]
    for key, button, differs in (
        (None, "left", turned),
        ("Shift", "left", moved),
        ("Control", "left", zoomed),
        (None, "middle", moved),
    ):
        seen_from(page, lambda key=key, button=button: drag(page, (900, 480), key, button), differs)
        shots.append(picture(page))
    seen_from(page, lambda: page.mouse.wheel(0, 400), zoomed)
    shots.append(picture(page))
    page.click("#do-fit")
    until(page, lambda: not np.array_equal(look(page), shots[-1]))
    shots.append(picture(page))
    assert all(not np.array_equal(one, other) for one, other in pairwise(shots))


def test_the_tree_is_still_drawn_after_a_look_at_the_other_tabs(page):
    green = leaves_at_rest(page)
    for tab, shown in (("years", "#years-figures"), ("scan", "#scan-line"), ("model", "#figures")):
        page.click(f"#tab-{tab}")
        page.locator(shown).wait_for(state="attached" if tab == "scan" else "visible")
    until(page, lambda: leaves_drawn(page) > 0.9 * green)
    press(page, "leaf_size_m")
    click(page, "undo")
