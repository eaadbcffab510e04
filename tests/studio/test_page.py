"""The page in a real browser without a window: what a person does, and what they see of it."""

import re
import socket
import subprocess
import sys
from pathlib import Path

import pytest

sync_api = pytest.importorskip("playwright.sync_api", reason="drives a browser; pip install playwright")
pytest.importorskip("trame_pyvista", reason='needs the modeller; pip install "treepipe[studio]"')

from pipeline.exchange import read_model  # noqa: E402  # after the skips
from pipeline.studio.files import Folders, open_parameters  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
CHROMIUM = Path("/usr/bin/chromium")
DRAWS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
PATIENCE_MS = 30_000
START = "seed = 7\niterations = 20\n"
LONG = "seed = 7\niterations = 100\ndensity_begin = 0.6\n" + "".join(
    f"crown_{side}_m = 16\n" for side in ("width", "height", "depth")
)

pytestmark = pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no browser at {CHROMIUM}")


def studio(*arguments):
    return subprocess.Popen(
        [sys.executable, "-m", "pipeline", "studio", "--no-browser", *map(str, arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=ROOT,
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("studio")
    (made / "start.toml").write_text(START)
    return made


@pytest.fixture(scope="module")
def address(folder):
    with studio("--port", 0, folder / "start.toml") as server:
        said = server.stdout.readline()
        assert "studio at http://127.0.0.1:" in said
        yield said.split()[2]
        server.terminate()
        server.communicate()


@pytest.fixture(scope="module")
def browser():
    with sync_api.sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=str(CHROMIUM), args=DRAWS)
        yield opened
        opened.close()


@pytest.fixture
def page(browser, address):
    tab = browser.new_page(viewport={"width": 1280, "height": 800})
    tab.set_default_timeout(PATIENCE_MS)
    tab.abroad, tab.wrong = [], []
    tab.on("request", lambda request: tab.abroad.append(request.url) if is_abroad(request.url) else None)
    tab.on("pageerror", lambda error: tab.wrong.append(str(error)))
    tab.goto(address)
    tab.wait_for_function("+document.querySelector('#figures')?.dataset.shown > 0")
    tab.wait_for_function("!document.querySelector('#stop')")
    yield tab
    assert not tab.wrong
    assert not tab.abroad
    tab.close()


def is_abroad(url):
    return not re.match(r"(https?|wss?)://127\.0\.0\.1[:/]|data:|blob:", url)


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
    page.locator(f"#set-{name} .v-slider-thumb").focus()
    until_shown(page, lambda: page.keyboard.press(key))


def click(page, name):
    until_shown(page, lambda: page.click(f"#do-{name}"))


def colours_drawn(page):
    """Count the colours in the picture: the sky alone has few."""
    import io

    from PIL import Image

    shot = page.screenshot(clip={"x": 340, "y": 60, "width": 930, "height": 650})
    return len(Image.open(io.BytesIO(shot)).convert("RGB").getcolors(1_000_000))


def test_a_tree_with_leaves_is_there_at_the_start(page):
    shown = figures(page)
    assert shown["seed"] == "7"
    assert int(shown["triangles"].replace(",", "")) > int(shown["nodes"].replace(",", "")) > 100
    assert "ended: " in page.inner_text("#figure-reason")
    page.wait_for_timeout(1500)
    assert colours_drawn(page) > 500


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


def test_the_page_can_be_loaded_again(page):
    press(page, "stem_thickness")
    before, thickness = figures(page), page.inner_text("#set-stem_thickness")
    page.reload()
    page.wait_for_function("+document.querySelector('#figures')?.dataset.shown > 0")
    assert figures(page) == before
    assert page.inner_text("#set-stem_thickness") == thickness
    click(page, "undo")
    page.wait_for_timeout(1500)
    assert colours_drawn(page) > 500


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
    page.wait_for_selector("#trouble")
    assert "exists already; give another name" in page.inner_text("#trouble")


def test_parameter_files_are_opened_or_explained(page, tmp_path):
    (tmp_path / "odd.toml").write_text("iterations = 1000")
    (tmp_path / "huge.toml").write_text("#" * 200_000)
    (tmp_path / "good.toml").write_text("seed = 11\niterations = 12")
    before = figures(page)
    for name, says in (("odd", "iterations = 1000 is not allowed"), ("huge", "choose a parameter file")):
        page.click("#files")
        page.set_input_files("#open-parameters", tmp_path / f"{name}.toml")
        page.wait_for_selector("#trouble")
        assert says in page.inner_text("#trouble")
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


def test_a_long_growth_shows_its_progress_and_can_be_stopped(page, tmp_path):
    (tmp_path / "long.toml").write_text(LONG)
    before = figures(page)
    page.click("#files")
    page.set_input_files("#open-parameters", tmp_path / "long.toml")
    page.wait_for_function("/growing: iteration/.test(document.querySelector('#doing')?.innerText)")
    page.keyboard.press("Escape")
    page.click("#stop")
    page.wait_for_function("/stopped/.test(document.querySelector('#doing')?.innerText)")
    assert figures(page) == before
    until_shown(page, lambda: page.click("#do-undo"))
    assert figures(page) == before


def test_a_browser_that_closes_in_the_middle_leaves_a_server(browser, address, page, tmp_path):
    (tmp_path / "long.toml").write_text(LONG)
    other = browser.new_page()
    other.goto(address)
    other.wait_for_selector("#figures")
    other.click("#files")
    other.set_input_files("#open-parameters", tmp_path / "long.toml")
    other.wait_for_selector("#stop")
    other.close()
    click(page, "undo")
    assert figures(page)["seed"] == "7"


def test_a_port_in_use_is_a_sentence():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        with studio("--port", taken.getsockname()[1]) as server:
            _, said = server.communicate(timeout=60)
    assert server.returncode == 1
    assert "give another one with --port" in said
    assert "Traceback" not in said
