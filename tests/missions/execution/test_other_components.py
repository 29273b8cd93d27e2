"""Another component keeps the parameters that it has too, wherever it is named."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import robots
from missions.execution.prepare import Diagnosis, RunOptions, diagnose
from stack.errors import InputError


def diagnosis(tmp_path: Path, top: str, **options: Any) -> Diagnosis:
    text = f"mission: a\nrobot: scout\nworld: office\n{top}\nrun: {{wait: 1 s}}\n"
    (tmp_path / "a.yaml").write_text(text, "utf-8")
    return diagnose(tmp_path / "a.yaml", RunOptions(**options))


SETTINGS = "navigation: {planner: {use: astar, tolerance: 1.5, cost_weight: 6.0}}"


@pytest.mark.parametrize("after", [False, True])
def test_the_command_line_names_a_planner(tmp_path: Path, after: bool) -> None:
    given = {"planner.use": "theta_star", "planner.traversal_weight": "1.5"}
    given = dict(reversed(given.items())) if after else given
    found = diagnosis(tmp_path, SETTINGS, parameters=given)
    assert found.plan is not None
    planner = found.plan.choices["planner"]
    assert (planner.name, planner.parameters.tolerance) == ("theta_star", 1.5)
    assert planner.parameters.traversal_weight == 1.5
    (warning,) = (item for item in found.findings if item.code == "W114")
    assert warning.sentence == "planner: no effect on theta_star: cost_weight"
    assert warning.mark.line == 4


@pytest.mark.parametrize("source", ["file", "nav2"])
def test_a_mission_names_another_component_than_its_files(tmp_path: Path, source: str) -> None:
    (tmp_path / "p.yaml").write_text(
        "controller: {use: mppi, cruise_speed: 0.3, batch: 500}\n", "utf-8"
    )
    (tmp_path / "n.yaml").write_text(
        "controller_server:\n  ros__parameters:\n    controller_plugins: [F]\n"
        "    F: {plugin: 'a::MPPIController', vx_max: 0.3, batch_size: 500}\n",
        "utf-8",
    )
    top = "navigation: {controller: graceful}\nparameters: [p.yaml]"
    if source == "nav2":
        top = "navigation: {nav2_params: n.yaml, controller: graceful}"
    found = diagnosis(tmp_path, top)
    assert found.plan is not None
    assert found.plan.choices["controller"].name == "graceful"
    assert found.plan.choices["controller"].parameters.cruise_speed == 0.3
    (warning,) = (item for item in found.findings if item.code == "W114")
    assert warning.sentence == "controller: no effect on graceful: batch"
    assert Path(warning.mark.file).name == ("n.yaml" if source == "nav2" else "p.yaml")


def test_the_same_component_again_keeps_everything(tmp_path: Path) -> None:
    found = diagnosis(tmp_path, SETTINGS, parameters={"planner.use": "astar"})
    assert found.plan is not None
    assert found.plan.choices["planner"].parameters.cost_weight == 6.0
    assert not found.findings


def test_an_unknown_component_is_named(tmp_path: Path) -> None:
    with pytest.raises(Exception, match="there is no planner 'theta'"):
        diagnosis(tmp_path, SETTINGS, parameters={"planner.use": "theta"})


@pytest.mark.parametrize("kind", ["costmap", "safety"])
def test_settings_have_no_other_component(tmp_path: Path, kind: str) -> None:
    with pytest.raises(InputError, match=f"--parameter {kind}.use: {kind} has settings only"):
        diagnosis(tmp_path, "", parameters={f"{kind}.use": "another"})


def own_robot(tmp_path: Path, navigation: str) -> str:
    """A robot like scout, with settings of its own."""
    source = Path(robots.__file__).parent / "scout"
    text = (source / "robot.yaml").read_text("utf-8")
    (tmp_path / "robot.yaml").write_text(f"{text}navigation: {navigation}\n", "utf-8")
    for file in source.glob("*.urdf"):
        (tmp_path / file.name).write_text(file.read_text("utf-8"), "utf-8")
    return str(tmp_path / "robot.yaml")


@pytest.mark.parametrize("by", ["mission", "command line"])
def test_parameters_of_the_robot_without_effect_are_named(tmp_path: Path, by: str) -> None:
    robot = own_robot(tmp_path, "{planner: {use: astar, tolerance: 1.5, cost_weight: 6.0}}")
    top = "navigation: {planner: theta_star}" if by == "mission" else ""
    given = {} if by == "mission" else {"planner.use": "theta_star"}
    found = diagnosis(tmp_path, top, robot=robot, parameters=given)
    assert found.plan is not None
    assert found.plan.choices["planner"].parameters.tolerance == 1.5
    (warning,) = (item for item in found.findings if item.code == "W114")
    assert warning.sentence == "planner: no effect on theta_star: cost_weight"
    assert warning.mark.file == robot


@pytest.mark.parametrize("kind", ["planner", "controller", "localisation", "odometry", "costmap"])
def test_an_empty_name_on_the_command_line_is_refused(tmp_path: Path, kind: str) -> None:
    with pytest.raises(InputError, match=f"--parameter {kind}.use: the name"):
        diagnosis(tmp_path, "", parameters={f"{kind}.use": ""})


@pytest.mark.parametrize("value", ['""', '{use: ""}', "{use: 3}"])
@pytest.mark.parametrize("kind", ["planner", "costmap"])
def test_an_empty_name_in_a_file_is_refused(tmp_path: Path, kind: str, value: str) -> None:
    assert errors(tmp_path, f"navigation:\n  {kind}: {value}")
    robot = own_robot(tmp_path, f"\n  {kind}: {value}")
    (sentence,) = errors(tmp_path, "", robot=robot)
    assert f"{kind} must be a name or" in sentence


@pytest.mark.parametrize("layer", ['""', '{use: ""}'])
def test_an_empty_name_of_a_layer_is_refused(tmp_path: Path, layer: str) -> None:
    (sentence,) = errors(tmp_path, f"navigation: {{costmap: {{layers: [{layer}]}}}}")
    assert "layer ''" in sentence


def errors(tmp_path: Path, top: str, **options: Any) -> list[str]:
    try:
        found = diagnosis(tmp_path, top, **options).findings
    except InputError as error:
        found = error.findings
    return [str(item) for item in found if item.severity == "error"]
