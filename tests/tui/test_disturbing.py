"""Keys that disturb a simulated world, and the banner of the demo."""

from dataclasses import replace

import pytest
from textual.widgets import OptionList

from stack.types import Limitation
from tests.tui.sample_source import SampleSource
from tui.app import Dashboard
from tui.disturbing import choices
from tui.panes.banner import Banner, demo_notice
from tui.panes.map_pane import MapPane


@pytest.fixture
async def pilot():
    async with Dashboard(SampleSource(), live=False, is_demo=True).run_test(
        size=(120, 40)
    ) as pilot:
        await pilot.pause()
        yield pilot


def sent(pilot):
    return [(command.kind, dict(command.arguments)) for command in pilot.app.source.sent]


async def test_the_robot_is_lifted_to_a_place_on_the_map(pilot):
    await pilot.press("L", "right")
    draft = pilot.app.query_one(MapPane).draft
    assert "LIFT THE ROBOT HERE?" in str(pilot.app.query_one(Banner).render())
    await pilot.press("enter")
    await pilot.pause()
    pose = draft.pose
    assert sent(pilot) == [("lift_robot", {"x": pose.x, "y": pose.y, "heading": pose.heading})]


async def test_the_menu_has_everything_and_escape_does_nothing(pilot):
    await pilot.press("D")
    texts = [str(option.prompt) for option in pilot.app.screen.query_one(OptionList).options]
    assert "Take away the sensor lidar" in texts
    assert "Give back the sensor imu" in texts  # silent for 4.2 s in the sample
    await pilot.press("escape")
    assert sent(pilot) == []
    number = texts.index("Take away the sensor lidar")
    await pilot.press("D", *["down"] * number, "enter")
    await pilot.pause()
    assert sent(pilot) == [("silence_sensor", {"name": "lidar", "works": False})]


def test_every_choice_is_a_command_that_the_engine_knows():
    from stack.runtime.command_schema import read_arguments

    for choice in choices(SampleSource().poll()):
        if choice.kind != "lift_robot":  # its pose comes from the map
            read_arguments(choice.kind, choice.arguments)


def test_the_demo_says_why_the_robot_is_slow_else_what_happened_else_what_it_does():
    snapshot = SampleSource().poll()
    assert demo_notice(snapshot).detail == "go to lab: 9.9 m left, 0.48 m/s"
    box = SampleSource().events()[-1]
    box = replace(box, kind="box", text="a box was dropped", time=snapshot.time - 1.0)
    assert demo_notice(replace(snapshot, events=(box,))).detail == "a box was dropped"
    slow = Limitation("slower", "obstacle", "slower: obstacle 0.4 m ahead")
    near = replace(snapshot, events=(box,), limitations=(slow,))
    assert "obstacle" in demo_notice(near).detail


async def test_the_demo_always_says_what_to_press(pilot):
    pilot.app.refresh_now()
    assert "B drops a box" in str(pilot.app.query_one(Banner).render())
