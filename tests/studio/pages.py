"""What tests of every tab ask of the page."""


def is_told(page, text):
    """Wait until the sentence over the picture holds a text; one of before may still stand there."""
    page.locator("#trouble", has_text=text).wait_for()
