"""What a browser draws that comes before the picture is laid down for those who come later."""

from tests.studio.pages import colours_drawn, until

START = "seed = 7\niterations = 20\n"
NEVER = "import pipeline.studio.view as view; view.REST_S = 1e6"


def test_a_browser_that_comes_early_draws_the_first_tree_and_what_follows(visit, served, tmp_path):
    (tmp_path / "start.toml").write_text(START)
    page = visit(served(tmp_path / "start.toml", first=NEVER))
    page.wait_for_function("+document.querySelector('#figures').dataset.shown > 0")
    until(page, lambda: colours_drawn(page) > 500)
    page.reload()
    page.wait_for_function("+document.querySelector('#figures')?.dataset.shown > 0")
    until(page, lambda: colours_drawn(page) > 500)
    before = colours_drawn(page)
    page.click("#do-seed")
    until(page, lambda: colours_drawn(page) not in (before, 1))
