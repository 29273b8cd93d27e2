"""The dashboard on recorded runs: every key of it, and what it shows at which time."""

import inspect

import pytest
from textual.actions import parse
from textual.widgets import Input, Static

from stack.errors import TelemetryError
from stack.telemetry.hub import SNAPSHOTS, Telemetry
from stack.telemetry.recorder import Recorder, RunFolder
from stack.telemetry.recording_parameters import RecordingParameters
from stack.telemetry.records import Command, Event
from stack.telemetry.snapshots.log import SnapshotLog
from stack.telemetry.snapshots.recording import SnapshotRecording
from tests.stack.telemetry.synthetic_run import SyntheticRun
from tests.tui.recorded_run import EVENTS, Wall, record
from tui.panes.events_pane import EventsPane
from tui.panes.map_pane import MapPane
from tui.panes.tree_pane import TreePane
from tui.replay.app import AskTime, ReplayDashboard, seconds_of
from tui.replay.player import Player, is_failure
from tui.sheets.whole_text import WholeText


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("run")
    record(path)
    return path


@pytest.fixture
def wall():
    return Wall()


@pytest.fixture
def player(folder, wall):
    player = Player(SnapshotRecording(folder), wall)
    yield player
    player.close()


@pytest.fixture
async def pilot(player):
    async with ReplayDashboard(player, live=False).run_test(size=(120, 40)) as pilot:
        await pilot.pause()
        yield pilot


def watch(pilot, wall, seconds):
    for _ in range(round(seconds * 10)):
        wall.now += 0.1
        pilot.app.refresh_now()


async def press(pilot, *keys):
    await pilot.press(*keys)
    pilot.app.refresh_now()
    await pilot.pause()


def test_every_key_names_an_action_that_takes_its_arguments():
    for key in ReplayDashboard.KEYS:
        _, name, arguments = parse(key.action)
        inspect.signature(getattr(ReplayDashboard, f"action_{name}")).bind(None, *arguments)


def test_no_key_has_two_meanings():
    names = [name for key in ReplayDashboard.KEYS for name in key.keys.split(",")]
    assert len(names) == len(set(names))


@pytest.mark.parametrize(
    ("text", "seconds"),
    [("83.5", 83.5), ("1:23.5", 83.5), ("1:02:03", 3723.0), (" 7 s ", 7.0), ("0", 0.0),
     ("", None), ("-3", None), ("1:2:3:4", None), ("noon", None), ("1e3", None)],
)  # fmt: skip
def test_times_are_read_as_people_write_them(text, seconds):
    assert seconds_of(text) == seconds


async def test_it_plays_in_real_time_and_stops_at_the_end(pilot, player, wall):
    watch(pilot, wall, 5.0)
    assert pilot.app.snapshot.time == pytest.approx(5.0, abs=0.21)
    await press(pilot, "greater_than_sign", "greater_than_sign")
    watch(pilot, wall, 3.0)
    assert pilot.app.snapshot.time == pytest.approx(17.0, abs=0.21)
    watch(pilot, wall, 10.0)
    assert not player.is_playing
    assert pilot.app.snapshot.time == player.end
    await press(pilot, "space")  # from the beginning again
    assert player.is_playing
    assert pilot.app.snapshot.time < 0.3


async def test_pause_and_steps(pilot, player, wall):
    watch(pilot, wall, 2.0)
    await press(pilot, "p")
    watch(pilot, wall, 2.0)
    at = pilot.app.snapshot.time
    assert at == pytest.approx(2.0, abs=0.21)
    await press(pilot, "full_stop")
    assert pilot.app.snapshot.time > at
    await press(pilot, "comma")
    assert pilot.app.snapshot.time == at
    for _ in range(30):
        await press(pilot, "comma")
    assert pilot.app.snapshot.time == player.begin


async def test_skips_stay_within_the_run(pilot, player):
    for keys, time in (
        ("right_square_bracket", 5.0), ("right_curly_bracket", player.end),
        ("left_square_bracket", player.end - 5.0), ("left_curly_bracket", 0.0),
        ("end", player.end), ("home", 0.0),
    ):  # fmt: skip
        await press(pilot, keys)
        assert pilot.app.snapshot.time == pytest.approx(time, abs=0.21)


@pytest.mark.parametrize(
    ("kind", "level", "fields", "stops"),
    [("doubt", "warning", {"doubt": "lost"}, True), ("doubt", "info", {"doubt": "none"}, False),
     ("failsafe", "warning", {}, True), ("node_status", "info", {"to": "failure"}, True),
     ("held", "warning", {}, False), ("body", "error", {}, True)],
)  # fmt: skip
def test_what_the_key_for_failures_stops_at(kind, level, fields, stops):
    assert is_failure(Event(0, 0, 1.0, level, "test", kind, "text", fields)) == stops


async def test_events_and_failures(pilot, player):
    times = []
    for _ in range(4):
        await press(pilot, "n")
        times.append(round(pilot.app.snapshot.time, 2))
    assert times == list(EVENTS)
    await press(pilot, "n")  # there is none: it stays
    assert pilot.app.snapshot.time == pytest.approx(17.05)
    await press(pilot, "N")
    assert pilot.app.snapshot.time == pytest.approx(17.0)
    await press(pilot, "home", "x")
    assert pilot.app.snapshot.time == pytest.approx(17.0)
    assert not player.is_playing


async def test_enter_shows_whole_texts(pilot):
    await press(pilot, "end")
    await press(pilot, "enter")
    text = str(pilot.app.screen.query_one(Static).render())
    assert text.index("it is 17") < text.index("it is 4")  # the newest first
    await press(pilot, "enter")
    assert not isinstance(pilot.app.screen, WholeText)


@pytest.mark.parametrize(
    ("kind", "level", "is_one"),
    [("sensor", "warning", True), ("sensor", "info", False), ("camera", "warning", True),
     ("doubt", "warning", True), ("replan", "warning", False), ("replan", "error", True)],
)  # fmt: skip
def test_a_silent_sensor_is_a_failure_to_stop_at(kind, level, is_one):
    assert is_failure(Event(0, 0, 1.0, level, "", kind, "")) is is_one


def test_doors_are_shown_as_they_are_at_the_head(folder, wall):
    ends = ((4.0, 0.5), (4.0, 1.5))
    player = Player(SnapshotRecording(folder), wall, doors={"gate": ends})
    player._log += [Event(0, 0, 5.0, "info", "", "door", "", {"door": "gate", "closed": True})]
    assert player.doors_at_head() == [(ends, False)]
    player.seek(6.0)
    assert player.doors_at_head() == [(ends, True)]
    player.close()


async def test_changes_of_the_selected_node(pilot):
    await press(pilot, "1", *["up"] * 20)
    tree = pilot.app.query_one(TreePane)
    row = next(row for row in SyntheticRun().tree_at(0.0) if row.name == "Inspect")
    await press(pilot, *["down"] * row.id)
    assert tree.chosen_row.name == "Inspect"
    await press(pilot, "s")  # it starts at 9 s and ends at 12 s: synthetic_run.tree_at
    assert pilot.app.snapshot.time == pytest.approx(9.0)
    await press(pilot, "s")
    assert pilot.app.snapshot.time == pytest.approx(12.0)
    await press(pilot, "S")
    assert pilot.app.snapshot.time == pytest.approx(9.0)


async def test_go_to_a_time(pilot):
    await press(pilot, "colon", *"0:21", "enter")
    assert pilot.app.snapshot.time == pytest.approx(21.0, abs=0.21)
    await press(pilot, "colon", *"noon", "enter")
    assert isinstance(pilot.app.screen, AskTime)
    assert pilot.app.screen.query_one(Input).value == "noon"
    await press(pilot, "escape")
    assert pilot.app.snapshot.time == pytest.approx(21.0, abs=0.21)


async def test_a_jump_back_forgets_the_future(pilot, wall):
    watch(pilot, wall, 20.0)
    events, trail = pilot.app.query_one(EventsPane), pilot.app.query_one(MapPane)
    assert len(events.lines) == 4
    driven = len(trail._trail)
    await press(pilot, "left_square_bracket", "left_square_bracket")
    assert len(events.lines) == 1  # that of 4 s
    assert 0 < len(trail._trail) < driven
    await press(pilot, "right_square_bracket")
    assert len(events.lines) == 2


async def test_clicking_the_line_of_time_goes_there(pilot, player):
    await press(pilot, "space")
    line = pilot.app.query_one("#timeline")
    await pilot.click("#timeline", offset=(line.size.width - 2, 0))
    pilot.app.refresh_now()
    assert pilot.app.snapshot.time == pytest.approx(player.end, abs=0.5)


@pytest.mark.parametrize("kind", ["estop", "set_goal", "pause", "set_parameter", "something new"])
def test_commands_are_refused(player, kind):
    with pytest.raises(TelemetryError, match="this is a replay: there is no robot to"):
        player.send(Command("1", kind))


def test_a_run_that_is_still_written_is_followed(tmp_path, wall):
    run = SyntheticRun()
    sinks = [
        Recorder(RunFolder(tmp_path)),
        SnapshotLog(tmp_path / SNAPSHOTS, RecordingParameters()),
    ]
    telemetry = Telemetry(run.info(), sinks)

    def write(first, end):
        for step in range(first, end):
            telemetry.advance(step, step * 0.05)
            telemetry.publish(lambda step=step: run.snapshot_at(step * 0.05))

    write(0, 41)
    player = Player(SnapshotRecording(tmp_path), wall)
    wall.now += 5.0
    assert player.poll().time == pytest.approx(2.0)
    write(41, 61)
    player.land()
    wall.now += 1.0
    player.poll()
    assert player.is_playing
    player.land()
    wall.now += 1.0
    assert player.poll() is None  # it is at the newest
    assert player.time == pytest.approx(3.0)
    telemetry.close(None)
    wall.now += 1.0
    player.poll()
    wall.now += 1.0
    player.poll()
    assert not player.is_playing
    player.close()
