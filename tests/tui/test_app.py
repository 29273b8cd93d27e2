"""Every key of the dashboard, pressed on a source that records what it is told."""

import inspect
from dataclasses import replace

import numpy as np
import pytest
from textual.actions import parse
from textual.widgets import OptionList

from stack.errors import TelemetryError
from stack.telemetry.records import Ack, MissionState
from stack.types import Battery, Detection, Limitation, Pose2D, TrackedObject
from tests.tui.sample_source import SampleSource, finished
from tui.app import Dashboard
from tui.drawing import palette
from tui.keys import KEYS
from tui.panes.banner import Banner
from tui.panes.events_pane import EventsPane
from tui.panes.map_pane import MapPane
from tui.panes.tree_pane import TreePane
from tui.run_view import PANES
from tui.screens import Question


@pytest.fixture
def source():
    return SampleSource()


@pytest.fixture
async def pilot(source):
    async with Dashboard(source, live=False).run_test(size=(120, 40)) as pilot:
        await pilot.pause()
        yield pilot


def kinds(source):
    return [command.kind for command in source.sent]


def refresh(pilot, **changes):
    pilot.app.source.changes.update(changes)
    pilot.app.refresh_now()


def banner_text(pilot):
    banner = pilot.app.screen_stack[0].query_one(Banner)
    return str(banner.render()) if banner.display else ""


def test_every_key_names_an_action_that_takes_its_arguments():
    for key in KEYS:
        _, name, arguments = parse(key.action)
        action = getattr(Dashboard, f"action_{name}")
        inspect.signature(action).bind(None, *arguments)


def test_no_key_has_two_meanings():
    names = [name for key in KEYS for name in key.keys.split(",")]
    assert len(names) == len(set(names))


async def press_space_everywhere(pilot, source, openings, *, dialogs):
    """One press, one command, nothing else; `escape` closes a dialog."""
    base = pilot.app.screen
    for opening in openings:
        source.sent.clear()
        await pilot.press(*opening.split())
        before = pilot.app.screen
        assert (before is not base) == dialogs, opening
        await pilot.press("space")
        assert kinds(source) == ["estop"], opening
        assert pilot.app.screen is before, opening
        await pilot.press("shift+space", "space")
        assert kinds(source) == ["estop"] * 3, opening
        while pilot.app.screen is not base:
            await pilot.press("escape")


async def test_space_stops_in_every_pane(pilot, source):
    await press_space_everywhere(pilot, source, ["1", "2", "3", "4", "5", "z"], dialogs=False)


async def test_space_stops_on_every_screen(pilot, source):
    """Dialogs; a text that is being typed is another matter."""
    keys = ["question_mark", "a", "q", "ctrl+c", "1 f"]
    await press_space_everywhere(pilot, source, keys, dialogs=True)


async def test_space_in_a_question_chooses_nothing(pilot, source):
    await pilot.press("a", "down")
    assert isinstance(pilot.app.focused, OptionList)
    await pilot.press("space", "space")
    assert kinds(source) == ["estop", "estop"]
    assert isinstance(pilot.app.screen, Question)


async def test_an_unconfirmed_stop_is_shouted_about(pilot, source):
    source.acks = list
    await pilot.press("space")
    for _ in range(10):
        pilot.app.refresh_now()
    assert banner_text(pilot) == ""
    pilot.app.refresh_now()
    assert "NOT CONFIRMED" in banner_text(pilot)
    await pilot.press("space")
    pilot.app.refresh_now()
    assert "NOT CONFIRMED" in banner_text(pilot)  # sent again, and still not answered
    source.acks = lambda: [Ack(source.sent[0].id, True)]  # the first one's answer
    pilot.app.refresh_now()
    assert "NOT CONFIRMED" not in banner_text(pilot)


async def test_a_stop_that_cannot_be_sent_is_shouted_about_at_once(pilot, source):
    def send(command):
        raise TelemetryError("cannot estop: the engine does not answer")

    source.send = send
    await pilot.press("space")
    pilot.app.refresh_now()
    assert "NOT CONFIRMED" in banner_text(pilot)


async def test_the_answer_to_a_stop_is_shown(pilot, source):
    await pilot.press("space")
    pilot.app.refresh_now()
    await pilot.pause()
    assert [note.title for note in pilot.app._notifications] == ["emergency stop"]
    assert "accepted" in next(iter(pilot.app._notifications)).message


async def test_a_refused_stop_stays_unconfirmed(pilot, source):
    source.refusal = "another run"
    await pilot.press("space")
    for _ in range(12):
        pilot.app.refresh_now()
    assert "NOT CONFIRMED" in banner_text(pilot)


async def test_typed_markup_is_no_markup(pilot, source):
    """The value is quoted in the complaint about it."""
    await pilot.press("e", "enter", "ctrl+u")
    await pilot.press("[", "/", "]", "enter")
    await pilot.pause()
    assert source.sent == []
    assert "'[/]': expected a number" in str(pilot.app.screen.query_one("#hint").render())


async def test_the_arrows_drive_while_the_mission_lets_the_operator(pilot, source):
    await pilot.press("up", "shift+left", "enter")
    assert source.sent == []
    refresh(
        pilot, teleop=True,
        limitations=(Limitation("slower", "obstacle", "something 0.3 m ahead"),),
    )  # fmt: skip
    assert "TELEOPERATION" in banner_text(pilot)
    assert "slower: something 0.3 m ahead" in banner_text(pilot)
    await pilot.press("up", "down", "left", "right", "shift+left", "shift+right")
    assert [dict(command.arguments) for command in source.sent] == [
        {"linear": 0.25, "angular": 0.0}, {"linear": -0.25, "angular": 0.0},
        {"linear": 0.0, "angular": 0.6}, {"linear": 0.0, "angular": -0.6},
        {"lateral": 0.2}, {"lateral": -0.2},
    ]  # fmt: skip
    assert set(kinds(source)) == {"teleop"}
    await pilot.press("enter")
    assert kinds(source)[-1] == "teleop_done"
    refresh(pilot, teleop=False)
    assert banner_text(pilot) == ""


async def test_the_arrows_drive_whatever_has_the_focus(pilot, source):
    await pilot.press("4", "down")
    assert source.sent == []
    refresh(pilot, teleop=True)
    await pilot.press("down", "1", "up")
    assert kinds(source) == ["teleop", "teleop"]


async def test_a_velocity_that_comes_too_late_is_not_worth_a_word(pilot, source):
    refresh(pilot, teleop=True)
    source.refusal = "the mission drives"
    await pilot.press("up")
    pilot.app.refresh_now()
    await pilot.pause()
    assert list(pilot.app._notifications) == []


async def test_abort_asks_first(pilot, source):
    await pilot.press("a", "enter")
    assert source.sent == []
    await pilot.press("a", "escape")
    assert source.sent == []
    await pilot.press("a", "down", "enter")
    assert kinds(source) == ["abort"]


async def test_a_refused_command_is_told(pilot, source):
    source.refusal = "the mission has not [begun]"
    await pilot.press("p")
    pilot.app.refresh_now()
    await pilot.pause()
    assert [note.message for note in pilot.app._notifications] == ["the mission has not [begun]"]


async def test_a_command_that_cannot_leave_is_told(pilot, source):
    def send(command):
        raise TelemetryError("cannot pause: the engine does not answer")

    source.send = send
    await pilot.press("p", "space")
    await pilot.pause()
    assert len(pilot.app._notifications) == 2


async def test_the_simulation_can_be_sped_up_and_down(pilot, source):
    await pilot.press("greater_than_sign", "greater_than_sign", "less_than_sign")
    assert [command.arguments["factor"] for command in source.sent] == [2.0, 4.0, 2.0]
    assert set(kinds(source)) == {"speed"}


async def test_plus_and_minus_zoom_the_map_and_f_fits_it(pilot):
    pane = pilot.app.query_one(MapPane)
    whole = pane.view
    await pilot.press("plus")
    assert pane.view.metres_per_dot == pytest.approx(whole.metres_per_dot / 1.4)
    assert pane.following
    await pilot.press("equals_sign", "minus", "minus")
    assert pane.view.metres_per_dot == pytest.approx(whole.metres_per_dot, rel=0.01)
    await pilot.press("f")
    assert pane.view == whole and not pane.following


async def test_arrows_move_the_map(pilot):
    pane = pilot.app.query_one(MapPane)
    start = pane.view
    await pilot.press("right", "up")
    assert pane.view.x > start.x and pane.view.y > start.y
    await pilot.press("left", "down")
    assert (pane.view.x, pane.view.y) == pytest.approx((start.x, start.y))


async def test_arrows_choose_a_node_while_the_tree_has_the_focus(pilot):
    tree = pilot.app.query_one(TreePane)
    await pilot.press("1")
    start = tree.chosen
    await pilot.press("down", "down", "up")
    assert tree.chosen == start + 1 and tree.pinned
    await pilot.press("t")
    assert tree.chosen == start and not tree.pinned


async def test_c_hides_the_costs(pilot):
    pane = pilot.app.query_one(MapPane)
    before = [strip.text for strip in pane._strips]
    colours = {segment.style for strip in pane._strips for segment in strip}
    await pilot.press("c")
    assert [strip.text for strip in pane._strips] == before
    assert {segment.style for strip in pane._strips for segment in strip} != colours


async def test_l_goes_through_the_levels(pilot):
    log = pilot.app.query_one(EventsPane)
    counts = [len(log.lines)]
    for _ in range(4):
        await pilot.press("l")
        counts.append(len(log.lines))
    # Of the sample's 12 events one is a quiet one, two are warnings and one is an error.
    assert counts == [11, 3, 1, 12, 11]


async def test_a_pane_without_room_comes_over_the_whole_screen(source):
    async with Dashboard(source, live=False).run_test(size=(60, 20)) as pilot:
        for key, name in zip("12345", PANES, strict=True):
            await pilot.press(key)
            await pilot.pause()
            pane = pilot.app.screen.query_one(f"#{name}")
            assert pilot.app.focused is pane and pane.size.width >= 30
            await pilot.press("escape")
            await pilot.pause()
            pilot.app.refresh_now()
            assert pilot.app.query_one(MapPane).size.width >= 30
            assert pilot.app.focused.size.width > 0


@pytest.mark.parametrize(
    ("key", "answer", "result", "sent"),
    [("q", [], None, []), ("ctrl+c", ["down"], "leave", []),
     ("ctrl+q", ["down", "down"], "abort", ["abort"])],
)  # fmt: skip
async def test_leaving_a_running_mission_asks(source, key, answer, result, sent):
    app = Dashboard(source, live=False)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press(key, *answer, "enter")
        await pilot.pause()
        assert app.return_value == result
        assert kinds(source) == sent
        assert app._exit == (result is not None)
    assert source.closed


async def test_the_question_is_asked_once(pilot):
    await pilot.press("ctrl+c", "ctrl+c", "ctrl+c")
    assert len(pilot.app.screen_stack) == 2


async def test_a_finished_run_stays_until_q_which_asks_nothing(pilot, source):
    finished(source, MissionState.FAILURE, "go to lab: NO_VALID_PATH: the door is blocked")
    pilot.app.refresh_now()
    assert "MISSION FAILED" in banner_text(pilot)
    assert "the door is blocked" in banner_text(pilot)
    assert not pilot.app._exit
    await pilot.press("q")
    assert pilot.app.return_value == "over"


async def test_a_lost_engine_is_left_without_asking(pilot, source):
    source.silent_for = 6.0
    pilot.app.refresh_now()
    assert "ENGINE LOST" in banner_text(pilot)
    assert pilot.app.screen.has_class("stale")
    await pilot.press("q")
    assert pilot.app.return_value == "lost"


async def test_an_engine_of_another_version_is_told(pilot, source):
    def poll():
        raise TelemetryError("the engine speaks version 9, expected 1: install the same treepilot")

    source.poll = poll
    pilot.app.refresh_now()
    assert "install the same treepilot" in banner_text(pilot)
    await pilot.press("q")
    assert pilot.app.return_value == "lost"


async def test_news_comes_in_while_a_question_is_open(pilot, source):
    await pilot.press("a")
    source.tick += 30
    refresh(pilot, state=MissionState.EMERGENCY_STOP)
    assert pilot.app.screen_stack[0].has_class("stopped")


async def test_nothing_yet_is_drawn_as_waiting():
    source = SampleSource(-1)
    source.info = None
    async with Dashboard(source, live=False).run_test(size=(80, 24)) as pilot:
        for key in ("plus", "f", "right", "c", "t", "l", "z", "1", "down", "escape"):
            await pilot.press(key)
        pane = pilot.app.query_one(MapPane)
        middle = pane.render_line(pane.size.height // 2).text
        assert "waiting for the map" in middle


async def test_a_bare_snapshot_is_drawn(pilot, source):
    full = source.poll()
    bare = type(full)(
        1.0,
        20,
        MissionState.STARTING,
        "",
        (),
        Pose2D(1.0, 2.0),
        np.zeros((3, 3)),
        0.0,
        Battery(0.0),
    )
    source.poll = lambda: replace(bare)
    source.info = None
    pilot.app.refresh_now()
    await pilot.press("plus", "f", "right", "c")
    pane = pilot.app.query_one(MapPane)
    text = "".join(strip.text for strip in pane._strips)
    assert "→" in text  # the robot, in an unknown world


async def test_what_moves_is_drawn_with_its_way(pilot):
    """A circle, and from its middle a second of its way at 2 m/s."""

    def cells():
        person = palette.css(palette.PERSON)
        rows = pilot.app.query_one(MapPane)._strips
        return sum(person in str(part.style) for row in rows for part in row if part.text.strip())

    someone = TrackedObject(1, 0.0, (14.0, 5.0), (2.0, 0.0), 0.3, np.eye(4))
    refresh(pilot, people=None, tracks=())
    assert cells() == 0
    refresh(pilot, tracks=(replace(someone, velocity=(0.0, 0.0)),))
    standing = cells()
    refresh(pilot, tracks=(someone,))
    assert 0 < standing < cells()


async def test_detected_objects_stand_on_the_map_with_their_label(pilot):
    def text():
        rows = pilot.app.query_one(MapPane)._strips
        return "\n".join("".join(part.text for part in row) for row in rows)

    chair = Detection("chair", 0.0, (14.0, 5.0), 0.05, 0.5, 0.9, (0, 0, 9, 9), 0.8)
    refresh(pilot, detections=(replace(chair, label="a\x1b[31m\nb"), chair))
    assert "◆chair" in text() and "\x1b" not in text()
    refresh(pilot, detections=())
    assert "◆chair" not in text()


async def test_a_run_without_a_map_keeps_the_robot_in_the_middle(pilot, source):
    refresh(pilot, layers={})
    pilot.app.query_one(MapPane).fit()
    pane = pilot.app.query_one(MapPane)
    first = pane.view
    source.tick -= 200
    pilot.app.refresh_now()
    assert pane.following and pane.view != first


@pytest.mark.parametrize(
    "size", [(20, 6), (40, 12), (62, 20), (80, 24), (90, 30), (120, 40), (240, 70)]
)
async def test_every_size_works_and_the_map_keeps_thirty_columns(source, size):
    async with Dashboard(source, live=False).run_test(size=(120, 40)) as pilot:
        await pilot.resize_terminal(*size)
        await pilot.pause()
        pilot.app.refresh_now()
        assert pilot.app.query_one(MapPane).outer_size.width >= 30
        assert pilot.app.query_one("#charts").display == (size[0] >= 116)


async def test_a_refresh_while_the_panes_are_taken_down_does_nothing(source):
    """The timer of a live dashboard may go off after the panes are gone."""
    async with Dashboard(source, live=False).run_test(size=(80, 24)) as pilot:
        await pilot.app.screen.remove_children()
        pilot.app.refresh_in_turn()
        assert pilot.app.is_running


async def test_a_refresh_after_the_screens_are_gone_does_nothing(source, monkeypatch):
    async with Dashboard(source, live=False).run_test(size=(80, 24)) as pilot:
        with monkeypatch.context() as patched:
            patched.setattr(Dashboard, "screen_stack", [])
            pilot.app.refresh_in_turn()


async def test_a_live_dashboard_refreshes_by_itself(source):
    async with Dashboard(source).run_test(size=(80, 24)) as pilot:
        refresh(pilot)
        source.changes["state"] = MissionState.PAUSED
        await pilot.pause(0.25)
        assert "PAUSED" in banner_text(pilot)
