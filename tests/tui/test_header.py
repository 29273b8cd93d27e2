"""The header of each situation: a row of the table each, and which of two wins."""

from dataclasses import replace

import pytest

from stack.telemetry.records import Debugging, MissionState
from stack.types import Limitation, Twist
from tests.tui.sample_source import SampleSource
from tui.app import Dashboard
from tui.link import Link
from tui.panes.banner import notice
from tui.panes.header import HEADERS, header
from tui.panes.status_bar import StatusBar

S = MissionState
NO_RECOVERY = tuple(row for row in SampleSource().poll().tree if row.kind != "recover")
RUNNING = replace(SampleSource().poll(), tree=NO_RECOVERY, health=0.9)
CALM = Link(0.1)
STOPPED = Limitation("stopped", "emergency stop", "operator")
STANDING = {"measured": Twist()}
RECOVERING = tuple(
    replace(row, status="running" if row.name == "recovery" else row.status)
    for row in SampleSource().poll().tree
)

CASES = {
    "✘ INCOMPATIBLE ENGINE": ({}, Link(0.1, trouble="version 9")),
    "■ OVER, EMERGENCY STOP ENGAGED": (
        {"state": S.ABORTED, "limitations": (STOPPED,)}, CALM,
    ),
    "✔ SUCCESS": ({"state": S.SUCCESS}, Link(99.0, is_over=True)),
    "✘ FAILURE": ({"state": S.FAILURE}, CALM),
    "⊘ ABORTED": ({"state": S.ABORTED}, CALM),
    "⊘ INTERRUPTED": ({"state": S.INTERRUPTED}, CALM),
    "✘ ERROR": ({"state": S.ERROR}, CALM),
    "⊘ ENDED": ({}, Link(0.1, is_over=True, has_report=True)),
    "✘ ENGINE CRASHED": ({}, Link(0.1, is_over=True)),
    "✘ ENGINE LOST": ({}, Link(5.1)),
    "▲ ENGINE NOT ANSWERING": ({}, Link(2.1)),
    "■ STOP NOT CONFIRMED": ({}, Link(0.1, stop_unconfirmed=True)),
    "■ EMERGENCY STOP, BRAKING": ({"state": S.EMERGENCY_STOP, "measured": Twist(0.3)}, CALM),
    "■ EMERGENCY STOP, STANDING": ({"state": S.EMERGENCY_STOP, **STANDING}, CALM),
    "⚑ OPERATOR'S DETOUR (mission paused)": ({"state": S.PAUSED, "detour": True}, CALM),
    "‖ YOUR GOAL IS PAUSED": ({"state": S.PAUSED, "detour_held": True, **STANDING}, CALM),
    "● STOPPED AT BREAKPOINT": ({"state": S.PAUSED, "debugging": Debugging(held=(7,))}, CALM),
    "‖ PAUSED, BRAKING": ({"state": S.PAUSED, "measured": Twist(0.0, -0.4)}, CALM),
    "‖ PAUSED": ({"state": S.PAUSED, **STANDING}, CALM),
    "◆ WAITING FOR YOU TO DRIVE": ({"teleop": True, **STANDING}, CALM),
    "◆ YOU ARE DRIVING": ({"teleop": True, "measured": Twist(0.2)}, CALM),
    "▲ LOST, RECOVERING": ({"health": 0.29, "tree": RECOVERING}, CALM),
    "▲ LOST": ({"health": 0.29}, CALM),
    "✚ RECOVERING": ({"tree": RECOVERING}, CALM),
    "◌ STARTING": ({"state": S.STARTING}, CALM),
    "▶ RUNNING": ({}, CALM),
}  # fmt: skip


def test_every_row_has_a_case():
    assert list(CASES) == [words for words, _, _ in HEADERS]


@pytest.mark.parametrize("words", CASES)
def test_the_header_says_what_happens(words):
    changes, link = CASES[words]
    shown = header(replace(RUNNING, **changes), link)
    assert shown.words == words
    assert shown.tone == next(tone for row, tone, _ in HEADERS if row == words)


@pytest.mark.parametrize(
    ("link", "words"),
    [
        (Link(3.0), "◌ WAITING FOR THE ENGINE"),
        (Link(20.1), "✘ NO ENGINE ANSWERS"),
        (Link(0.1, is_over=True), "✘ ENGINE CRASHED"),
        (Link(0.1, is_over=True, has_report=True), "⊘ ENDED"),
        (Link(0.1, trouble="version 9"), "✘ INCOMPATIBLE ENGINE"),
    ],
)
def test_without_a_snapshot_it_tells_of_the_engine(link, words):
    assert header(None, link).words == words


def test_a_lost_robot_is_told_whatever_else_happens():
    lost = replace(RUNNING, health=0.2)
    assert (header(lost, CALM).tone, header(lost, CALM).alarms) == ("warn", ())
    for changes in ({"state": S.PAUSED, "detour": True}, {"teleop": True}):
        assert header(replace(lost, **changes), CALM).alarms == ("LOST",)
    assert header(replace(lost, state=S.FAILURE), CALM).alarms == ()


def test_a_robot_that_retries_is_not_recovering():
    """In the sample the first child of `recover` runs, which is the second attempt itself."""
    assert header(SampleSource().poll(), CALM).words == "▶ RUNNING"


def test_lost_records_are_told_until_the_end():
    lost = replace(RUNNING, records_lost="sensors.mcap: no space left on device")
    assert header(lost, CALM).alarms == ("RECORDS LOST",)
    assert header(replace(lost, state=S.SUCCESS), CALM).alarms == ("RECORDS LOST",)
    assert notice(lost, CALM).detail == "sensors.mcap: no space left on device"


async def test_what_holds_the_robot_is_told_in_the_place_of_the_node():
    source, held = SampleSource(), Limitation("stopped", "obstacle", "a chair ahead")
    app = Dashboard(source, live=False)
    async with app.run_test(size=(160, 24)):
        bar = app.query_one(StatusBar)
        bar.show(replace(RUNNING, limitations=(held,)), source.info, CALM)
        assert "held: a chair ahead" in bar.render_line(0).text
        bar.show(replace(RUNNING, limitations=()), source.info, CALM)
        assert "held" not in bar.render_line(0).text


@pytest.mark.parametrize("columns", [20, 40, 80, 120])
async def test_it_can_be_read_at_every_width(columns):
    """All of it from 44 columns on; below that its beginning."""
    source = SampleSource()
    app = Dashboard(source, live=False)
    async with app.run_test(size=(columns, 24)):
        bar = app.query_one(StatusBar)
        for words, (changes, link) in CASES.items():
            bar.show(replace(RUNNING, **changes), source.info, link)
            assert words[: columns - 4] in bar.render_line(0).text
