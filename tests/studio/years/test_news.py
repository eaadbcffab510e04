"""What the worker of the Years tab tells: not too often, and the whole story once."""

from types import SimpleNamespace

import pytest

pytest.importorskip("trame_pyvista", reason='needs the modeller; pip install "treepipe[studio]"')

from pipeline.studio.years.growing import Story  # after the skip
from pipeline.studio.years.news import News


@pytest.fixture
def shown():
    return []


@pytest.fixture
def news(shown):
    """News of a machine on which every step takes a second."""
    seconds = iter(range(100))
    state = SimpleNamespace(update=lambda _said: None)
    shell = SimpleNamespace(clock=lambda: float(next(seconds)), soon=lambda act: act(), state=state)
    return News(shell, SimpleNamespace(show_story=shown.append))


def test_the_whole_story_is_shown_once(news, shown, plan, grower):
    news.begins(plan(years=2))
    whole = grower.grow(plan(years=2), news.growing)
    news.done(whole)
    assert [len(story.years) for story in shown] == [1, 2, 3]
    assert shown[-1] is whole
    assert isinstance(shown[0], Story)
