"""The page in a real browser without a window: what a person does, and what they see of it."""

import io
import socket

import numpy as np
import pytest
from PIL import Image

from pipeline.exchange import read_model
from pipeline.formats.png import packed
from pipeline.studio.folders import Folders
from pipeline.studio.modeller.files import open_parameters
from tests.studio.pages import is_told

START = "seed = 7\niterations = 20\n"
PATIENCE_MS = 60_000
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


def picture_of(page):
    """(H, W, 3) what is drawn of the tree."""
    shot = page.screenshot(clip={"x": 340, "y": 110, "width": 930, "height": 600})
    return np.asarray(Image.open(io.BytesIO(shot)).convert("RGB"))


def until_shown(page, act):
    """Do something, and wait until another tree is shown."""
    before = page.get_attribute("#figures", "data-shown")
    act()
    page.wait_for_function(f"document.querySelector('#figures').dataset.shown != '{before}'")
    page.wait_for_function("!document.querySelector('#stop')")


def press(page, name, key="ArrowLeft"):
    """Move a slider by the keyboard."""
    page.locator(f"#set-{name} .v-slider-thumb").focus()
    until_shown(page, lambda: page.keyboard.press(key))


def click(page, name):
    until_shown(page, lambda: page.click(f"#do-{name}"))


def test_a_tree_with_leaves_is_there_at_the_start(page, colours_drawn):
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
    page.click("#examples")
    until_shown(page, lambda: page.click("#preset-bush"))
    assert figures(page)["seed"] == "7"
    assert page.inner_text("#set-stem_length_m").split()[-2:] == ["0", "m"]
    click(page, "reset")
    assert page.inner_text("#set-iterations").split()[-1] == "30"
    click(page, "undo")
    click(page, "undo")
    assert figures(page) == before


def test_the_page_can_be_loaded_again(page, colours_drawn):
    press(page, "stem_thickness")
    before, thickness = figures(page), page.inner_text("#set-stem_thickness")
    page.reload()
    page.wait_for_function("+document.querySelector('#figures')?.dataset.shown > 0")
    assert figures(page) == before
    assert page.inner_text("#set-stem_thickness") == thickness
    click(page, "undo")
    until(page, lambda: colours_drawn(page) > 500)


def test_what_is_downloaded_can_be_read(page, tmp_path):
    page.click("#files")
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
    page.click("#files")
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
        page.click("#files")
        page.set_input_files("#open-parameters", tmp_path / f"{name}.toml")
        is_told(page, says)
        page.keyboard.press("Escape")
        page.reload()
        page.wait_for_selector("#figures")
    assert figures(page) == before
    page.click("#files")
    until_shown(page, lambda: page.set_input_files("#open-parameters", tmp_path / "good.toml"))
    assert figures(page)["seed"] == "11"
    page.keyboard.press("Escape")
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
    page.click("#files")
    page.fill("#save-name", "mine.obj")
    page.keyboard.press("Control+z")
    page.wait_for_timeout(500)
    assert figures(page) == after
    page.keyboard.press("Escape")
    click(page, "undo")


def grow_long(page, tmp_path, parameters=LONG):
    """Open parameters of a tree that takes its time, and wait until twigs are shown."""
    (tmp_path / "long.toml").write_text(parameters)
    page.click("#files")
    page.set_input_files("#open-parameters", tmp_path / "long.toml")
    page.wait_for_function("/growing: iteration/.test(document.querySelector('#doing')?.innerText)")
    page.keyboard.press("Escape")


def leaves_drawn(page):
    """Count the pixels that are green."""
    red, green, blue = np.moveaxis(picture_of(page).astype(int), 2, 0)
    return int(((green > red + 15) & (green > blue + 15)).sum())


def until(page, holds):
    """Wait until something holds of the picture."""
    for _ in range(PATIENCE_MS // 200):
        if holds():
            return
        page.wait_for_timeout(200)
    assert holds()


def test_a_long_growth_shows_its_twigs_and_can_be_stopped(page, tmp_path):
    before = figures(page)
    until(page, lambda: leaves_drawn(page) > 1000)
    green = leaves_drawn(page)
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


def test_a_browser_that_closes_in_the_middle_leaves_a_server(browser, address, page, tmp_path):
    other = browser.new_page()
    other.goto(address)
    grow_long(other, tmp_path, LONG.replace("seed = 7", "seed = 8"))
    other.close()
    click(page, "undo")
    assert figures(page)["seed"] == "7"


def test_two_browsers_show_one_tree(visit, address, page, colours_drawn):
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
    page.click("#files")
    page.set_input_files("#open-parameters", folder / "odd.toml")
    is_told(page, "odd.png: is no PNG picture; save it as PNG")
    said = page.inner_text("#trouble")
    assert f"treepipe: {said}" in served.log.read_text()
    page.keyboard.press("Escape")
    click(page, "undo")
    assert figures(page) == before
    assert not page.query_selector("#trouble")


def test_pictures_of_ones_own_are_drawn(page, folder):
    page.click("#files")
    for name, colour in (("bark", (250, 0, 250)), ("leaf", (0, 250, 250))):
        (folder / f"{name}.png").write_bytes(packed(np.full((8, 8, 3), colour, dtype=np.uint8)))
    named = "".join(f"{name}_picture = '{folder / name}.png'\n" for name in ("bark", "leaf"))
    (folder / "mine.toml").write_text(f"{START}{named}")
    until_shown(page, lambda: page.set_input_files("#open-parameters", folder / "mine.toml"))
    page.keyboard.press("Escape")

    def drawn(channel):
        shot = picture_of(page).astype(int)
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


def drag(page, end):
    """Drag from the picture's middle as a hand does: the view overlooks the first move after a rest."""
    page.mouse.move(800, 400)
    page.mouse.down()
    for share in (0.25, 0.5, 0.75, 1.0):
        page.mouse.move(800 + share * (end[0] - 800), 400 + share * (end[1] - 400))
        page.wait_for_timeout(50)
    page.mouse.up()


def test_the_tree_is_seen_from_all_sides_and_fitted_again(page):
    until(page, lambda: leaves_drawn(page) > 1000)
    shots = [picture_of(page)]

    def seen_anew(act):
        act()
        until(page, lambda: np.any(picture_of(page) != shots[-1]))
        shots.append(picture_of(page))

    seen_anew(lambda: drag(page, (1000, 500)))  # turns
    page.keyboard.down("Shift")
    seen_anew(lambda: drag(page, (700, 450)))  # moves
    page.keyboard.up("Shift")
    seen_anew(lambda: page.mouse.wheel(0, 400))
    seen_anew(lambda: page.click("#do-fit"))


def test_the_tree_is_still_drawn_after_a_look_at_the_other_tabs(page):
    until(page, lambda: leaves_drawn(page) > 1000)
    green = leaves_drawn(page)
    for tab in ("years", "scan", "model"):
        page.click(f"#tab-{tab}")
        page.wait_for_timeout(500)
    until(page, lambda: leaves_drawn(page) > 0.9 * green)
    press(page, "leaf_size_m")
    click(page, "undo")
