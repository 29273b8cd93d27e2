"""Changing a parameter, and giving a place by its name."""

import pytest
from textual.widgets import Input, OptionList

from tests.tui.sample_source import PARAMETERS, SampleSource
from tui.app import Dashboard
from tui.tuning import ParameterScreen, parsed


@pytest.mark.parametrize(
    ("text", "present", "value"),
    [
        ("0.4", 0.5, 0.4),
        (" 400 ", 500, 400),
        ("30 cm/s", 0.5, "30 cm/s"),
        ("yes", False, True),
        ("0", True, False),
        ("a", "b", "a"),
    ],
)
def test_values_keep_the_kind_of_the_present_one(text, present, value):
    assert parsed(text, present) == value
    assert type(parsed(text, present)) is type(value)


@pytest.mark.parametrize(
    ("text", "present"), [("fast", 0.5), ("3 parsecs", 0.5), ("1.5", 500), ("maybe", True)]
)
def test_a_value_of_another_kind_is_refused_and_quoted(text, present):
    with pytest.raises(ValueError, match=f"'{text}': expected"):
        parsed(text, present)


async def test_a_parameter_is_changed_by_one_command():
    source = SampleSource()
    async with Dashboard(source, live=False).run_test(size=(80, 24)) as pilot:
        await pilot.press("e", "enter")
        await pilot.pause()
        line = pilot.app.screen.query_one(Input)
        assert line.value == str(PARAMETERS["controller.cruise_speed"])
        line.value = "fast"
        await pilot.press("enter")
        assert isinstance(pilot.app.screen, ParameterScreen) and source.sent == []
        line.value = "0.35"
        await pilot.press("enter")
        await pilot.pause()
    assert [(c.kind, c.arguments) for c in source.sent] == [
        ("set_parameter", {"name": "controller.cruise_speed", "value": 0.35})
    ]


async def test_parameters_for_experts_are_listed_on_request():
    async with Dashboard(SampleSource(), live=False).run_test(size=(80, 24)) as pilot:
        await pilot.press("e")
        names = [option.id for option in pilot.app.screen.query_one(OptionList).options]
        assert names == ["controller.cruise_speed", "planner.allow_unknown"]
        await pilot.press("x")
        names = [option.id for option in pilot.app.screen.query_one(OptionList).options]
        assert names == sorted(PARAMETERS)
        await pilot.press("enter")
        await pilot.pause()
        await pilot.press("x")
        assert pilot.app.screen.query_one(Input).value == "x"


@pytest.mark.parametrize("stop", ["ctrl+space", "ctrl+@"])
async def test_a_space_in_a_value_is_a_space_and_with_ctrl_it_stops(stop):
    source = SampleSource()
    async with Dashboard(source, live=False).run_test(size=(80, 24)) as pilot:
        await pilot.press("e", "enter", "end", "space", "c", "m")
        assert pilot.app.screen.query_one(Input).value.endswith(" cm")
        assert source.sent == []
        assert "ctrl+space stops" in str(pilot.app.screen.query_one("#hint").render())
        await pilot.press(stop)
        assert [command.kind for command in source.sent] == ["estop"]
        await pilot.press("escape")
        assert len(source.sent) == 1 and not isinstance(pilot.app.screen, ParameterScreen)


@pytest.mark.parametrize(("key", "kind"), [("g", "set_goal"), ("i", "set_pose")])
async def test_places_are_chosen_by_name(key, kind):
    source = SampleSource()
    async with Dashboard(source, live=False).run_test(size=(80, 24)) as pilot:
        await pilot.press(key, "enter")
        assert source.sent == []
        await pilot.press(key, "down", "down", "enter")
        await pilot.pause()
    kitchen = source.info.places["kitchen"]
    assert [(c.kind, c.arguments) for c in source.sent] == [
        (kind, {"x": kitchen.x, "y": kitchen.y, "heading": kitchen.heading})
    ]


async def test_runs_without_places_or_parameters_say_so():
    source = SampleSource(-1)
    source.info = None
    async with Dashboard(source, live=False).run_test(size=(80, 24)) as pilot:
        await pilot.press("e", "g", "i")
        await pilot.pause()
        assert len(pilot.app._notifications) == 3 and len(pilot.app.screen_stack) == 1
