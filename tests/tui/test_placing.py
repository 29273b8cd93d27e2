"""Goals and poses: by name, by coordinates, by the mouse and by keys on the map."""

from math import pi

import numpy as np
import pytest
from textual.widgets import OptionList

from stack.types import Pose2D
from tests.tui.sample_source import SampleSource
from tui.app import Dashboard
from tui.drawing.canvas import View
from tui.panes.banner import Banner
from tui.panes.map_pane import MapPane
from tui.panes.placing import Draft
from tui.places import PlaceScreen, pose_words


@pytest.fixture
async def pilot():
    async with Dashboard(SampleSource(), live=False).run_test(size=(120, 40)) as pilot:
        await pilot.pause()
        yield pilot


def sent(pilot):
    return [(command.kind, command.arguments) for command in pilot.app.source.sent]


def draft(pilot):
    return pilot.app.query_one(MapPane).draft


def banner(pilot):
    pilot.app.refresh_now()
    shown = pilot.app.query_one(Banner)
    return str(shown.render()) if shown.display else ""


def test_the_point_of_a_character_is_drawn_in_that_character():
    view = View(3.0, -2.0, 0.07)
    for column, row in ((0, 0), (17, 5), (39, 19)):
        dots = view.dots(np.array([view.point(column, row, 40, 20)]), 40, 20)[0]
        assert (dots[0] // 2, dots[1] // 4) == (column, row)


@pytest.mark.parametrize(("key", "kind"), [("g", "set_goal"), ("i", "set_pose")])
async def test_a_place_is_found_by_part_of_its_name(pilot, key, kind):
    await pilot.press(key, *"kit", "enter")
    await pilot.pause()
    kitchen = pilot.app.source.info.places["kitchen"]
    assert sent(pilot) == [(kind, {"x": kitchen.x, "y": kitchen.y, "heading": kitchen.heading})]


async def test_a_name_that_begins_so_comes_before_one_that_contains_it(pilot):
    await pilot.press("g", "k")
    assert [option.id for option in pilot.app.screen.query_one(OptionList).options] == [
        "kitchen", "dock",
    ]  # fmt: skip


async def test_coordinates_take_units(pilot):
    await pilot.press(
        "g", *"2.5", "comma", "space", *"300", "space", *"cm", "comma", *"90", "space"
    )
    await pilot.press(*"deg", "enter")
    await pilot.pause()
    [(kind, pose)] = sent(pilot)
    assert kind == "set_goal"
    assert pose == {"x": 2.5, "y": pytest.approx(3.0), "heading": pytest.approx(pi / 2)}


@pytest.mark.parametrize("text", ["nowhere", "1,2,3,4", "1,apples"])
async def test_what_is_no_place_is_said_in_the_dialog(pilot, text):
    await pilot.press("g", *[{",": "comma"}.get(letter, letter) for letter in text], "enter")
    await pilot.pause()
    assert isinstance(pilot.app.screen, PlaceScreen) and sent(pilot) == []
    hint = str(pilot.app.screen.query_one("#hint").render())
    assert "nowhere" in hint or "pose" in hint or "apples" in hint
    await pilot.press("escape")
    assert sent(pilot) == []


async def test_press_places_drag_turns_release_asks_and_enter_confirms(pilot):
    pane = pilot.app.query_one(MapPane)
    at = (12, 14)  # in the frame of the widget; its border takes one
    await pilot.mouse_down(pane, offset=at)
    assert draft(pilot).kind == "set_goal" and banner(pilot) == ""
    await pilot.hover(pane, offset=(12, 8))
    await pilot.mouse_up(pane, offset=(12, 8))
    assert sent(pilot) == [] and "DRIVE HERE?" in banner(pilot)
    pose = draft(pilot).pose
    assert (pose.x, pose.y) == pytest.approx(pane.view.point(11, 13, *pane.size), abs=1e-9)
    assert pose.heading == pytest.approx(pi / 2)
    assert pose_words(pose) in banner(pilot)
    await pilot.press("enter")
    await pilot.pause()
    assert sent(pilot) == [("set_goal", {"x": pose.x, "y": pose.y, "heading": pose.heading})]
    assert draft(pilot) is None and banner(pilot) == ""


async def test_a_placed_pose_is_moved_turned_and_may_be_where_the_robot_is(pilot):
    await pilot.press("g", "enter")
    await pilot.pause()
    view = pilot.app.query_one(MapPane).view
    begin = draft(pilot).pose
    await pilot.press("right", "right", "up", "left", "down", "down")
    await pilot.press("left_square_bracket", "left_square_bracket", "right_square_bracket")
    moved = draft(pilot).pose
    assert moved.x - begin.x == pytest.approx(2 * view.metres_per_dot)
    assert moved.y - begin.y == pytest.approx(-4 * view.metres_per_dot)
    assert moved.heading - begin.heading == pytest.approx(pi / 12)
    await pilot.press("i")
    assert "IS THE ROBOT HERE?" in banner(pilot)
    await pilot.press("enter")
    await pilot.pause()
    assert [kind for kind, _ in sent(pilot)] == ["set_pose"]


async def test_escape_gives_it_up_and_the_keys_are_the_dashboard_s_again(pilot):
    await pilot.press("g", "enter")
    await pilot.pause()
    await pilot.press("space")
    assert sent(pilot) == [("estop", {"reason": "operator"})]
    await pilot.press("g", "escape")
    assert draft(pilot) is None
    await pilot.press("g")
    assert isinstance(pilot.app.screen, PlaceScreen)


def test_a_short_drag_keeps_the_heading():
    placed = Draft("set_goal", Pose2D(1.0, 1.0, 2.0))
    assert placed.facing(1.05, 1.0, least=0.2) == placed
