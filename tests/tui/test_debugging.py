"""Breakpoints, steps and forced outcomes from the tree's pane, and what the screen says of them."""

import pytest
from textual.widgets import OptionList

from stack.telemetry.records import Debugging, MissionState
from tests.tui.sample_source import SampleSource
from tui.app import Dashboard
from tui.keys import KEYS, TREE_KEYS, TREE_SENTENCE
from tui.link import Link
from tui.panes.banner import notice
from tui.panes.tree_pane import TreePane
from tui.screens import Help, Question

HELD = Debugging(breakpoints=(9, 11), held=(11,), forced={"10": "success"})
STOPPED = {
    "state": MissionState.PAUSED,
    "reason": "stopped at breakpoint: before 'report it' (a.yaml:31)",
    "debugging": HELD,
}


@pytest.fixture
def source():
    return SampleSource()


@pytest.fixture
async def pilot(source):
    async with Dashboard(source, live=False).run_test(size=(120, 40)) as pilot:
        await pilot.press("1")
        await pilot.pause()
        yield pilot


def sent(source):
    return [(command.kind, dict(command.arguments)) for command in source.sent]


def refresh(pilot, **changes):
    pilot.app.source.changes.update(changes)
    pilot.app.refresh_now()


def line_of(pilot, name):
    pane = pilot.app.query_one(TreePane)
    lines = [pane.render_line(y) for y in range(pane.list_height)]
    return next(line for line in lines if name in line.text)


async def test_b_sets_a_breakpoint_at_the_chosen_node_and_takes_it_away(pilot, source):
    pane = pilot.app.query_one(TreePane)
    await pilot.press("up", "b")
    row = source.poll().tree[pane.chosen]
    assert sent(source) == [("break", {"node": str(row.id), "generation": 0})]
    refresh(pilot, debugging=Debugging(breakpoints=(row.id,)))
    assert "▶●" in line_of(pilot, row.name).text
    await pilot.press("b")
    assert sent(source)[1:] == [("unbreak", {"node": str(row.id), "generation": 0})]


async def test_n_steps_and_c_goes_on_in_the_tree_only(pilot, source):
    await pilot.press("n", "c")
    assert sent(source) == [("step", {"ticks": 1}), ("continue", {})]
    await pilot.press("2", "n", "c", "b")
    assert len(source.sent) == 2


async def test_f_asks_which_outcome_to_force(pilot, source):
    refresh(pilot, **STOPPED)
    await pilot.press("up", "f")
    assert isinstance(pilot.app.screen, Question)
    answers = [option.id for option in pilot.app.screen.query_one(OptionList).options]
    assert answers == ["", "success", "failure", "off"]  # `look` is forced already
    await pilot.press("down", "down", "enter")
    assert sent(source) == [("force", {"node": "10", "generation": 0, "status": "failure"})]
    await pilot.press("down", "f", "escape")
    assert len(source.sent) == 1


async def test_an_event_can_be_made_due(pilot, source):
    rows = source.poll().tree
    event = type(rows[0])(0, -1, "low battery", "event", "idle")
    refresh(pilot, tree=(event,))
    await pilot.press("f", "down", "down", "down", "enter")
    assert sent(source) == [("force", {"node": "0", "generation": 0, "status": "due"})]


async def test_the_tree_goes_to_the_node_that_the_mission_stopped_before(pilot):
    refresh(pilot, **STOPPED)
    pane = pilot.app.query_one(TreePane)
    assert pane.chosen == 11
    assert "·◆" in line_of(pilot, "⚙ look").text
    assert "forced: success" in line_of(pilot, "⚙ look").text
    assert "·●" in line_of(pilot, "report it").text
    assert "starts next" in line_of(pilot, "report it").text


async def test_another_tree_is_told_and_followed(pilot, source):
    await pilot.press("up", "up")
    pane = pilot.app.query_one(TreePane)
    assert pane.pinned
    refresh(pilot, debugging=Debugging(generation=1), tree=source.poll().tree[:3])
    await pilot.pause()
    assert not pane.pinned
    assert pane.chosen < 3
    assert any("starts from its root" in note.message for note in pilot.app._notifications)
    await pilot.press("b")
    assert source.sent[-1].arguments["generation"] == 1


def test_the_banner_says_where_it_stopped_and_what_is_wrong_with_a_saved_file(source):
    source.changes.update(STOPPED)
    stopped = notice(source.poll(), Link(0.1))
    assert (stopped.headline, stopped.detail) == (
        "● STOPPED AT BREAKPOINT", "before 'report it' (a.yaml:31)",
    )  # fmt: skip
    faults = ("a.yaml:3:1 error[E120] no", "a.yaml:4:1 error[E121] no")
    source.changes.update(debugging=Debugging(faults=faults))
    refused = notice(source.poll(), Link(0.1))
    assert refused.headline == "✘ RELOAD FAILED, ‖ PAUSED"
    assert refused.detail == "a.yaml:3:1 error[E120] no; and 1 more in the log"


async def test_help_tells_of_the_keys_in_the_tree(pilot):
    await pilot.press("question_mark")
    assert isinstance(pilot.app.screen, Help)
    shown = str(pilot.app.screen.query_one("Static").render())
    assert TREE_SENTENCE in shown
    assert "b n f c" in shown


def test_the_tree_may_give_keys_another_meaning_but_not_those_that_stop_it():
    names = {name for key in TREE_KEYS for name in key.keys.split(",")}
    everywhere = {name for key in KEYS if key.everywhere for name in key.keys.split(",")}
    stops = {"space", "R", "p", "a", "q", "question_mark", "up", "down"}
    assert not names & (everywhere | stops)
