"""Sensors that the behaviours and components of a mission need, and the robot does not have."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from missions.execution.fit.components import MISSING, Marks
from missions.execution.fit.steps import every_leaf
from missions.execution.resources import load_robot
from missions.language.model import Mission
from missions.language.reading.header import LOCALISATION
from robots.load import robot_names
from stack.components import Choice, Component, Estimator, noun
from stack.documents import Finding, Mark
from stack.drivetrain.description import RobotDescription
from stack.drivetrain.needs import LIMBS, lacking, noun_of, sensors_of
from stack.parameters import values_of

SWITCHES = {("depth", "obstacles"): "depth_camera", ("place_recognition", "record"): "camera"}
"""Settings that switch on what needs a sensor. `markers` has its own check."""


def behaviour_needs(mission: Mission, robot: RobotDescription) -> list[Finding]:
    """Return an error for each behaviour that needs what the robot lacks, at its first use."""
    found: dict[tuple[str, str], Finding] = {}
    for step in every_leaf(mission):
        for need in lacking(step.behaviour.needs, robot):
            finding = missing(step.kind, need, step.mark, robot)
            found.setdefault((step.kind, need), finding)
    return list(found.values())


def component_needs(
    choices: Mapping[str, Choice], marks: Marks, robot: RobotDescription
) -> Iterator[Finding]:
    """Yield an error for each component that needs what the robot lacks."""
    by_markers = choices["markers"].parameters.localise
    for choice in choices.values():
        kind: type = choice.component
        if not issubclass(kind, Component):
            continue  # settings of a fixed part
        if issubclass(kind, Estimator) and kind.uses_markers and by_markers:
            continue  # markers correct its pose
        named = marks.mission.components.get(choice.kind)
        mark = marks.of("robot") if named is None else named.mark
        hint = "write `localisation: dead_reckoning`" if choice.kind == LOCALISATION else ""
        for need in lacking(kind.needs, robot):
            yield missing(f"the {noun(choice.kind)} {choice.name!r}", need, mark, robot, hint)
    for (setting, switch), need in SWITCHES.items():
        if values_of(choices[setting].parameters)[switch] is True and any(lacking((need,), robot)):
            mark = marks.of_component(setting, switch)
            yield missing(f"{setting}.{switch}", need, mark, robot, "remove it")


def missing(what: str, need: str, mark: Mark, robot: RobotDescription, hint: str = "") -> Finding:
    """Return the error that something needs what the robot lacks; `hint` is another remedy."""
    noun = noun_of(need)
    sentence = f"{what} needs {_article(noun)} {noun}, and {robot.name} has none"
    if need not in LIMBS:
        has = ", ".join(f"{name} ({kind})" for name, kind in sensors_of(robot).items())
        sentence += f"; it has {has}" if has else "; it has no sensor"
    others = list(_robots_with(need))
    use = f"use a robot with {_article(noun)} {noun}"
    use += f": {', '.join(others)}" if others else ""
    return Finding(mark, MISSING, sentence, f"{hint}, or {use}" if hint else use)


def _robots_with(need: str) -> Iterable[str]:
    for name in robot_names():
        if not any(lacking((need,), load_robot(name, Path()))):
            yield name


def _article(noun: str) -> str:
    return "an" if noun[0] in "aeiouAEIOU" else "a"
