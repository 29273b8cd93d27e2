"""The list of parameters: filtered, changed, refused, saved."""

import pytest
from textual.widgets import Input, OptionList

from tests.tui.sample_source import CRUISE_SPEED, PARAMETERS, SampleSource
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


def names(pilot):
    return [option.id for option in pilot.app.screen.query_one(OptionList).options]


def hint(pilot):
    return str(pilot.app.screen.query_one("#hint").render())


def value(pilot):
    return pilot.app.screen.query_one("#value", Input)


@pytest.fixture
async def picker():
    """The list of parameters is open; `pilot.app.source` keeps what is sent."""
    async with Dashboard(SampleSource(), live=False).run_test(size=(80, 24)) as pilot:
        await pilot.press("e")
        await pilot.pause()
        yield pilot


async def test_a_parameter_is_changed_by_one_command(picker):
    source = picker.app.source
    await picker.press("enter")
    await picker.pause()
    assert value(picker).value == "0.5 m/s"
    value(picker).value = "fast"
    await picker.press("enter")
    await picker.pause()
    assert source.sent == [] and "'fast': expected a number" in hint(picker)
    value(picker).value = "35 cm/s"
    await picker.press("enter")
    picker.app.refresh_now()
    await picker.pause()
    assert [(c.kind, c.arguments) for c in source.sent] == [
        ("set_parameter", {"name": CRUISE_SPEED, "value": "35 cm/s"})
    ]
    assert "is set" in hint(picker) and picker.app.focused.id == "filter"
    source.changes["parameters"] = PARAMETERS | {CRUISE_SPEED: 0.35}
    picker.app.refresh_now()
    await picker.pause()
    row = str(picker.app.screen.query_one(OptionList).get_option(CRUISE_SPEED).prompt)
    assert row.startswith("● ") and "0.35 m/s" in row
    assert "at the start 0.5 m/s" in str(picker.app.screen.query_one("#meaning").render())


async def test_a_refused_value_stays_with_its_reason_beside_it(picker):
    picker.app.source.refusal = "9 m/s must be at most 2 m/s"
    await picker.press("enter", "home", "9", "enter")
    picker.app.refresh_now()
    await picker.pause()
    assert "must be at most 2 m/s" in hint(picker)
    assert picker.app.focused.id == "value" and not picker.app._notifications


async def test_letters_filter_names_and_meanings(picker):
    changed = "localisation.particles"  # 500, and 400 at the start
    assert names(picker) == [CRUISE_SPEED, changed, "planner.allow_unknown"]
    await picker.press(*"unknown", "space", *"cells")
    assert names(picker) == ["planner.allow_unknown"]
    assert "plan through unknown cells" in str(picker.app.screen.query_one("#meaning").render())
    assert picker.app.source.sent == []


async def test_parameters_for_experts_are_listed_on_request(picker):
    await picker.press("ctrl+e")
    assert names(picker) == sorted(PARAMETERS)
    await picker.press("down", "down")
    await picker.press("enter", "x")
    assert value(picker).value == "x"  # what is typed replaces the value
    await picker.press("escape", "ctrl+e")
    assert "world.note" not in names(picker)


async def test_the_changed_ones_are_saved_as_a_parameter_file(picker, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    await picker.press("ctrl+s")
    file = tmp_path / "parameters-office_patrol-20260101-120000.yaml"
    assert file.read_text() == "localisation:\n  particles: 500\n"
    assert "1 changed parameter saved" in hint(picker)


@pytest.mark.parametrize("stop", ["ctrl+space", "ctrl+@"])
async def test_a_space_in_a_value_is_a_space_and_with_ctrl_it_stops(picker, stop):
    source = picker.app.source
    await picker.press("enter", "end", "space", "c", "m")
    assert value(picker).value.endswith(" cm")
    assert source.sent == [] and "ctrl+space stops" in hint(picker)
    await picker.press(stop)
    assert [command.kind for command in source.sent] == ["estop"]
    await picker.press("escape", "escape")
    assert len(source.sent) == 1 and not isinstance(picker.app.screen, ParameterScreen)


async def test_a_run_without_parameters_says_so():
    source = SampleSource(-1)
    source.info = None
    async with Dashboard(source, live=False).run_test(size=(80, 24)) as pilot:
        await pilot.press("e")
        await pilot.pause()
        assert len(pilot.app._notifications) == 1 and len(pilot.app.screen_stack) == 1
