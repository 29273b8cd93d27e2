"""Where each parameter comes from, and parameters given on the command line."""

from __future__ import annotations

import shutil

import pytest

import missions
from missions.execution.prepare import RunOptions
from missions.execution.records.origins import Origin
from missions.inspection.parameter_sources import filtered, for_users, parameters_of
from robots.load import find_robot
from stack.errors import InputError


def sources(mission: str, **given: str) -> dict[str, Origin]:
    parameters = {name.replace("__", "."): value for name, value in given.items()}
    return {item.name: item for item in parameters_of(mission, RunOptions(parameters=parameters))}


def line_of(mission: str, word: str) -> int:
    from missions.execution.resources import find_mission

    lines = find_mission(mission).read_text("utf-8").splitlines()
    return next(number for number, line in enumerate(lines, start=1) if word in line)


@pytest.mark.pain("n3111")
def test_each_value_names_the_file_and_line_that_sets_it() -> None:
    found = sources("19_from_nav2")
    line = line_of("19_from_nav2", "cruise_speed")
    speed = found["controller.cruise_speed"]
    assert (speed.value, speed.source) == ("0.5 m/s", f"19_from_nav2.yaml:{line}")
    assert speed.default == "0.8 m/s"  # of the pure pursuit
    assert found["controller.use"].source.startswith("parameters/nav2_params.yaml:")
    assert found["controller.moving_margin"].source == "default"


def test_a_mission_without_a_map_has_defaults_of_its_own() -> None:
    decay = sources("17_without_a_map")["costmap.decay"]
    assert (decay.value, decay.source) == ("300 s", "default without a map")
    assert decay.default == "300 s"


def test_the_command_line_has_the_print_result() -> None:
    found = sources("19_from_nav2", controller__cruise_speed="30 cm/s", planner__use="theta_star")
    assert found["controller.cruise_speed"].value == "0.3 m/s"
    assert found["controller.cruise_speed"].source == "--parameter"
    assert found["planner.use"].value == "theta_star"
    # Both planners have a tolerance; the file sets it for astar.
    assert found["planner.tolerance"].value == "0.125 m"
    assert found["planner.tolerance"].source.startswith("parameters/nav2_params.yaml:")


def test_settings_of_a_robot_name_its_file_if_another_component_keeps_them(tmp_path) -> None:
    shutil.copytree(find_robot("scout", tmp_path).parent, tmp_path / "mine")
    with (tmp_path / "mine" / "robot.yaml").open("a") as file:
        file.write("navigation: {planner: {use: astar, tolerance: 0.3}}\n")
    mission = tmp_path / "m.yaml"
    text = "mission: m\nrobot: mine/robot.yaml\nworld: office\nrun: {say: a}\n"
    mission.write_text(text)
    own = sources(str(mission))
    assert own["planner.tolerance"].source == "mine/robot.yaml"
    mission.write_text(f"{text}navigation: {{planner: theta_star}}\n")
    found = sources(str(mission))
    assert (found["planner.tolerance"].value, found["planner.use"].source) == ("0.3 m", "m.yaml:5")
    assert found["planner.tolerance"].source == "mine/robot.yaml"
    mission.write_text(f"{text}navigation: {{planner: {{use: theta_star, tolerance: 0.2}}}}\n")
    assert sources(str(mission))["planner.tolerance"].source == "m.yaml:5"


@pytest.mark.pain("n4049", "n5189")
@pytest.mark.parametrize(
    ("name", "value", "sentence"),
    [
        ("controller.cruise_sped", "1", "--parameter controller.cruise_sped: there is no"),
        ("controller.cruise_speed", "fast", "expected a number in m/s, got 'fast'"),
        ("controler.cruise_speed", "1", "did you mean 'controller'"),
        ("speed", "1", "expected KIND.NAME=VALUE"),
        ("controller.cruise_speed", "[", "command line:1:"),
        ("planner.use", "astra", "did you mean 'astar'"),
    ],
)
def test_a_wrong_parameter_is_refused_with_its_name(name: str, value: str, sentence: str) -> None:
    with pytest.raises(InputError) as refused:
        parameters_of("19_from_nav2", RunOptions(parameters={name: value}))
    assert sentence in str(refused.value)


def test_parameters_for_experts_are_left_out_unless_they_are_set_or_asked_for() -> None:
    found = parameters_of("19_from_nav2", RunOptions(parameters={"safety.slow_time": "2 s"}))
    names = {item.name for item in for_users(found, "")}
    assert {"safety.padding", "safety.slow_time"} <= names
    assert not {"safety.reaction_time", "safety.moving_padding"} & names
    asked = for_users(filtered(found, "reaction_time"), "reaction_time")
    assert [item.name for item in asked] == ["safety.reaction_time"]


def test_the_parameters_for_users_fit_on_a_page() -> None:
    found = parameters_of("01_drive_to_a_point")
    assert 60 <= len(for_users(found, "")) <= 80  # of over 200, components included


def test_a_list_of_zones_is_shown_by_their_names() -> None:
    values = {item.name: item.value for item in parameters_of("16_house_rules")}
    assert values["speed_limits.zones"] == "meeting room"


def test_layers_and_safety_zones_are_shown_with_what_their_list_sets() -> None:
    found = {item.name: item for item in parameters_of("16_house_rules") if item.is_set}
    layers, zones = found["costmap.layers"], found["safety.zones"]
    assert layers.value == "static, obstacle, denoise, keepout, preferred_lanes, social"
    assert layers.source == f"16_house_rules.yaml:{line_of('16_house_rules', '- static')}"
    assert zones.value == "bumper, near"
    assert found["preferred_lanes.cost_outside"].value == "30"
    assert (found["keepout.zones"].value, found["keepout.zones"].source) == (
        "wet floor", layers.source,
    )  # fmt: skip
    usual = {item.name: item for item in parameters_of("01_drive_to_a_point")}
    assert usual["costmap.layers"].value.startswith("static, obstacle")
    assert usual["safety.zones"].value == "none"
    assert not usual["costmap.layers"].is_set and not usual["safety.zones"].is_set


def test_a_run_takes_parameters() -> None:
    near = {"goal": "[2.6, 2.2, 45 deg]"}
    settings = {"controller.cruise_speed": "0.3"}
    slow = missions.run("01_drive_to_a_point", arguments=near, parameters=settings)
    usual = missions.run("01_drive_to_a_point", arguments=near)
    assert slow.status == usual.status == "success"
    assert slow.simulated_seconds > 1.3 * usual.simulated_seconds
