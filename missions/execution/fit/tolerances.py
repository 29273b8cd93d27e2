"""Goal tolerances of a mission, compared with what its robot can meet."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import degrees

from missions.execution.fit.steps import every_leaf
from missions.language.analysis.claims import mark_of, number_of
from missions.language.model import Mission
from stack.components import Choice, GoalTolerance
from stack.control.goal_alignment import finest_tolerance
from stack.documents import Finding, Mark
from stack.drivetrain.description import RobotDescription
from stack.parameters import declarations


def tolerance_findings(
    mission: Mission, robot: RobotDescription, choices: Mapping[str, Choice]
) -> Iterator[Finding]:
    """Yield a warning for each tolerance that is finer than the robot can be expected to meet."""
    finest = finest_tolerance(robot, choices["loop"].parameters.period)
    for step in every_leaf(mission):
        if not step.behaviour.goal_ports:
            continue
        value, accepted = step.ports.get("tolerance"), step.ports.get("accept")
        asked, coarse = number_of(value), number_of(accepted)
        if asked is not None and coarse is not None and coarse <= asked:
            sentence = f"accept: {_text(coarse, 'm')} is no coarser than the tolerance, "
            sentence += _text(asked, "m")
            hint = "accept a larger one, or leave it out"
            yield Finding(mark_of(accepted, step.mark), "W149", sentence, hint)
        if asked is not None and asked < finest.position:
            mark = mark_of(value, step.mark)
            yield _finding(mark, "tolerance", _text(asked, "m"), _text(finest.position, "m"), robot)
    yield from _of_checker(mission, robot, choices["goal_checker"], finest)


def _of_checker(
    mission: Mission, robot: RobotDescription, choice: Choice, finest: GoalTolerance
) -> Iterator[Finding]:
    """Yield warnings about the tolerances of the goal checker that the mission sets."""
    parameters: type = type(choice.parameters)
    named, declared = mission.components.get("goal_checker"), declarations(parameters)
    if named is None or (named.use or choice.name) != choice.name:
        return
    for name, least, unit in (
        ("position", finest.position, "m"),
        ("heading", finest.heading, "rad"),
    ):
        if name not in named.values or name not in declared or declared[name].unit != unit:
            continue
        asked = declared[name].read(named.values[name])
        if asked < least:
            mark = named.marks.get(name, named.mark)
            yield _finding(
                mark, f"goal_checker.{name}", _text(asked, unit), _text(least, unit), robot
            )


def _finding(mark: Mark, name: str, asked: str, least: str, robot: RobotDescription) -> Finding:
    sentence = f"{name}: {asked} is finer than {robot.name} can be expected to meet, {least}"
    hint = f"use at least {least}, or the drive may end in NO_PROGRESS"
    return Finding(mark, "W148", sentence, hint)


def _text(value: float, unit: str) -> str:
    return f"{degrees(value):.2g} deg" if unit == "rad" else f"{1000.0 * value:.2g} mm"
