"""What tests of every tab do with the page, and how they wait for it.

However slow the machine: a test waits until something holds (`until`, `wait_for_function`), and never for a
time; it compares pictures that have come to rest (`picture`); it opens and closes menus whole, because one
that is closing takes the focus along.
"""

import inspect
import io
import time

import numpy as np
import pytest
from PIL import Image

PATIENCE_MS = 180_000
FIRST_MS = 420_000
"""What is done for the first time on a machine compiles."""
LOOK_MS = 150
CLIP = {"x": 340, "y": 110, "width": 930, "height": 600}

VIEW = "Object.entries(trame.refs).find(([name, view]) => view?.getCamera && view.$el.offsetParent)"
"""The name and the view of the picture that is shown."""
STANDS = f"""() => {{
  const [name, view] = {VIEW}, wanted = trame.state.state[`camera_${{name}}`];
  return wanted && wanted.position.every((x, i) => Math.abs(x - view.getCamera().position[i]) < 1e-3);
}}"""
CLOSED = (
    "[...document.querySelectorAll('.v-overlay__content')].every((menu) => !menu.getClientRects().length)"
)


def comes_true(page, holds, patience_ms):
    """Look again and again whether something holds; tell whether it did in time."""
    end = time.monotonic() + patience_ms / 1000
    while not holds():
        if time.monotonic() > end:
            return False
        page.wait_for_timeout(LOOK_MS)
    return True


def until(page, holds):
    """Wait until something holds."""
    if not comes_true(page, holds, PATIENCE_MS):
        pytest.fail(
            f"does not come true within {PATIENCE_MS / 1000:.0f} s: {inspect.getsource(holds).strip()}"
        )


def is_told(page, text):
    """Wait until the sentence over the picture holds a text; one of before may still stand there."""
    page.locator("#trouble", has_text=text).wait_for()


def look(page, clip=None):
    """(H, W, 3) what is drawn at this moment."""
    shot = page.screenshot(clip=clip or CLIP)
    return np.asarray(Image.open(io.BytesIO(shot)).convert("RGB"))


def picture(page, clip=None):
    """(H, W, 3) what is drawn, as soon as two looks at it are the same."""
    looks = [look(page, clip)]

    def rests():
        looks.append(look(page, clip))
        return np.array_equal(*looks[-2:])

    until(page, rests)
    return looks[-1]


def colours_drawn(page, clip=None):
    """Count the colours in the picture: the sky alone has few."""
    return len(np.unique(picture(page, clip).reshape(-1, 3), axis=0))


def camera(page):
    """Return where the camera of the picture that is shown stands, and what it looks at: two (3,) arrays."""
    held = page.evaluate(f"{VIEW}[1].getCamera()")
    return np.array(held["position"]), np.array(held["focalPoint"])


def stands(page):
    """Wait until the camera stands where the page wants it."""
    page.wait_for_function(STANDS)


def open_menu(page, button):
    """Open a menu of the bar."""
    page.click(button)
    page.locator(".v-overlay--active .v-overlay__content").first.wait_for()


def close_menu(page):
    """Close it, and wait until it is gone with what it does to the focus."""
    page.keyboard.press("Escape")
    page.wait_for_function(CLOSED)


def choose(page, field, text):
    """Choose from a list."""
    page.wait_for_function(CLOSED)
    page.click(f".v-input:has({field}) .v-field__append-inner")
    page.locator(".v-overlay--active .v-list-item", has_text=text).first.click()
    page.wait_for_function(CLOSED)
