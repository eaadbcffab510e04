"""Print how long the studio takes from a slider to the picture, in a headless browser on this machine.

Run ``python tests/benchmarks/studio.py``. Every figure is the time from a key on the slider to the last thing
that the browser draws because of it, arrays fetched; and beside it what the server needed to make the tree.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from playwright.sync_api import Page, sync_playwright

ROOT = Path(__file__).resolve().parents[2]
CHROMIUM = "/usr/bin/chromium"
DRAWS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
TIMES = 9
QUIET_MS = 700  # so long nothing is drawn any more
WATCH = """
window.lastDraw = 0;
for (const name of ['drawArrays', 'drawElements']) {
  const plain = WebGL2RenderingContext.prototype[name];
  WebGL2RenderingContext.prototype[name] = function (...given) {
    window.lastDraw = performance.now();
    return plain.apply(this, given);
  };
}
window.addEventListener('keydown', () => { window.pressed = performance.now(); }, true);
"""
SLIDERS = {
    "leaf_size_m": "leaves alone",
    "gnarliness": "growth",
    "stem_thickness": "geometry",
    "crown_width_m": "growth, crown shown",
}


def main() -> None:
    """Serve the default tree, press keys, print."""
    with TemporaryDirectory() as folder:
        first = Path(folder) / "default.toml"
        first.write_text("seed = 1\n")
        command = [sys.executable, "-m", "pipeline", "studio", str(first), "--no-browser", "--port", "0"]
        serve(command)


def serve(command: list[str]) -> None:
    """Let a browser measure a studio."""
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=ROOT) as server:
        try:
            assert server.stdout
            address = server.stdout.readline().split()[2]
            with sync_playwright() as playwright:
                browser = playwright.chromium.launch(executable_path=CHROMIUM, args=DRAWS)
                page = browser.new_page(viewport={"width": 1280, "height": 800})
                page.add_init_script(WATCH)
                page.goto(address)
                page.wait_for_function("+document.querySelector('#figures')?.dataset.shown > 0")
                page.wait_for_timeout(2000)
                measure(page)
                browser.close()
        finally:
            server.terminate()


def measure(page: Page) -> None:
    """Print one line a slider, and how busy the machine was."""
    for name, kind in SLIDERS.items():
        page.click("#do-reset")
        page.wait_for_timeout(2000)
        thumb = page.locator(f"#set-{name} .v-slider-thumb")
        thumb.focus()
        taken, made = [], []
        for turn in range(TIMES + 1):
            shown = page.get_attribute("#figures", "data-shown")
            page.keyboard.press("ArrowLeft")
            page.wait_for_function(f"document.querySelector('#figures').dataset.shown != '{shown}'")
            page.wait_for_function(f"lastDraw > pressed && performance.now() - lastDraw > {QUIET_MS}")
            if turn:  # the first one compiles
                taken.append(page.evaluate("window.lastDraw - window.pressed"))
                made.append(float(page.inner_text("#figure-milliseconds")))
        triangles = page.inner_text("#figure-triangles")
        print(
            f"{name} ({kind}): median {statistics.median(taken):.0f} ms, "
            f"best {min(taken):.0f}, worst {max(taken):.0f}; "
            f"of it the server's modelling {statistics.median(made):.0f}; {triangles} triangles; "
            f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"
        )


if __name__ == "__main__":
    main()
