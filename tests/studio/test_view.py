"""What a browser draws that comes before the picture is laid down for those who come later."""

import pytest

START = "seed = 7\niterations = 20\n"
NEVER = "import pipeline.studio.view as view; view.REST_S = 1e6"


def test_a_browser_that_comes_early_draws_the_first_tree_and_what_follows(
    visit, served, tmp_path, colours_drawn
):
    (tmp_path / "start.toml").write_text(START)
    page = visit(served(tmp_path / "start.toml", first=NEVER))
    page.wait_for_function("+document.querySelector('#figures').dataset.shown > 0")
    draws(page, colours_drawn)
    page.reload()
    page.wait_for_function("+document.querySelector('#figures')?.dataset.shown > 0")
    draws(page, colours_drawn)
    before = colours_drawn(page)
    page.click("#do-seed")
    for _ in range(100):
        if colours_drawn(page) not in (before, 1):
            break
        page.wait_for_timeout(200)
    else:
        pytest.fail("the tree of the new seed is not drawn")


def draws(page, colours_drawn):
    """Wait until a tree is drawn, with its leaves."""
    for _ in range(100):
        if colours_drawn(page) > 500:
            return
        page.wait_for_timeout(200)
    assert colours_drawn(page) > 500
