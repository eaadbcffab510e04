"""A studio that is served, and a browser without a window; tests of every tab share them."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.studio.pages import PATIENCE_MS

ROOT = Path(__file__).resolve().parents[2]
CHROMIUM = Path("/usr/bin/chromium")
DRAWS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
SIZE = {"width": 1280, "height": 800}


@pytest.fixture(scope="session")
def browser():
    """Chromium; the test is skipped where it, or what drives it, is absent."""
    sync_api = pytest.importorskip("playwright.sync_api", reason="drives a browser; pip install playwright")
    pytest.importorskip("trame_pyvista", reason='needs the modeller; pip install "treepipe[studio]"')
    if not CHROMIUM.exists():
        pytest.skip(f"there is no browser at {CHROMIUM}")
    with sync_api.sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=str(CHROMIUM), args=DRAWS)
        yield opened
        opened.close()


@pytest.fixture(scope="session")
def studio():
    """Return what starts `treepipe studio` with arguments, as a process, after a line of Python."""

    def start(*arguments, log=subprocess.PIPE, first=""):
        line = f"{first}\nfrom pipeline.cli.main import main; main(prog_name='treepipe')"
        return subprocess.Popen(
            [sys.executable, "-c", line, "studio", "--no-browser", *map(str, arguments)],
            stdout=subprocess.PIPE,
            stderr=log,
            text=True,
            cwd=ROOT,
        )

    return start


@pytest.fixture(scope="module")
def served(studio, tmp_path_factory):
    """Return what serves a studio with files and tells its address; all end with the module.

    What they say on stderr stands in the file ``served.log``.
    """
    running = []

    def start(*files, first=""):
        with start.log.open("a") as log:
            server = studio("--port", 0, *files, log=log, first=first)
        running.append(server)
        said = server.stdout.readline()
        assert "studio at http://127.0.0.1:" in said, start.log.read_text()
        return said.split()[2]

    start.log = tmp_path_factory.mktemp("served") / "stderr.txt"
    yield start
    for server in running:
        server.terminate()
        server.communicate()


@pytest.fixture
def visit(browser):
    """Return what opens an address in a page of its own; it has asked nobody else and met no error."""
    pages = []

    def go(address):
        page = browser.new_page(viewport=SIZE)
        page.set_default_timeout(PATIENCE_MS)
        page.abroad, page.wrong = [], []
        page.on(
            "request", lambda request: page.abroad.append(request.url) if is_abroad(request.url) else None
        )
        page.on("pageerror", lambda error: page.wrong.append(str(error)))
        pages.append(page)
        page.goto(address, timeout=PATIENCE_MS)
        page.wait_for_selector("#figures", state="attached")
        return page

    yield go
    for page in pages:
        assert not page.wrong
        assert not page.abroad
        page.close()


def is_abroad(url):
    """Tell whether something else than this machine is asked."""
    return not re.match(r"(https?|wss?)://127\.0\.0\.1[:/]|data:|blob:", url)
