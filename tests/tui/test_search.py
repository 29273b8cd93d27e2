"""`/`: in the events, and in the help."""

import pytest
from textual.widgets import Static

from tests.tui.sample_source import SampleSource
from tui.app import Dashboard
from tui.panes.events_pane import EventsPane
from tui.screens import Help


@pytest.fixture
async def pilot():
    async with Dashboard(SampleSource(), live=False).run_test(size=(80, 24)) as pilot:
        await pilot.pause()
        yield pilot


def label(pilot):
    return str(pilot.app.query_one(EventsPane).border_subtitle)


async def test_the_newest_match_comes_first_and_n_goes_back(pilot):
    """The sample has three events of the tree besides the routine ones."""
    events = pilot.app.query_one(EventsPane)
    await pilot.press("slash", *"goal", "space", *"k", "enter")
    await pilot.pause()
    assert "goal k" in label(pilot) and "1 of 1" in label(pilot)
    assert pilot.app.focused is events
    await pilot.press("escape", "slash", *"spin", "enter")
    await pilot.press("escape", "slash", *"tree", "enter")
    await pilot.pause()
    assert "3 of 3" in label(pilot)  # lines of this source; node_status is routine
    await pilot.press("n")
    assert "2 of 3" in label(pilot)
    await pilot.press("N", "N")
    assert "1 of 3" in label(pilot)
    await pilot.press("escape")
    assert "of 3" not in label(pilot) and events.auto_scroll
    assert pilot.app.source.sent == []


async def test_what_is_nowhere_is_said(pilot):
    await pilot.press("slash", *"xyzzy", "enter")
    await pilot.pause()
    assert len(pilot.app._notifications) == 1 and "xyzzy" not in label(pilot)


async def test_the_help_is_filtered(pilot):
    await pilot.press("question_mark", "slash", *"costmap")
    await pilot.pause()
    shown = str(pilot.app.screen.query_one(Static).render())
    assert "show or hide the costmap" in shown and "emergency" not in shown
    await pilot.press("escape")
    assert "emergency" in str(pilot.app.screen.query_one(Static).render())
    await pilot.press("escape")
    assert not isinstance(pilot.app.screen, Help)
