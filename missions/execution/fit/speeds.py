"""Speeds of a mission, compared with the limits of its robot."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import hypot

from missions.execution.fit.steps import every_condition, every_step
from missions.language.analysis.claims import is_literal, mark_of, number_of
from missions.language.analysis.intervals import Interval, truth_values
from missions.language.analysis.ranges import comparisons, text_of_comparison
from missions.language.expressions.expression import CheckedExpression
from missions.language.expressions.robot_values import ROBOT_VALUES
from missions.language.expressions.terms import Named
from missions.language.kinds.leaf import LeafStep
from missions.language.model import Mission
from missions.language.step import Step
from missions.language.values import Constant, Value
from stack.components import Choice
from stack.documents import Finding, Mark
from stack.drivetrain.description import RobotDescription
from stack.errors import ParameterError
from stack.parameters import Declaration, declarations

MEASURED = 1.25
"""Measured speeds stay below this multiple of the robot's limit: slip, noise and overshoot."""


def speed_findings(mission: Mission, robot: RobotDescription) -> list[Finding]:
    """Return warnings about speeds that the robot cannot reach, in ports and comparisons."""
    found = [item for step in every_step(mission) for item in _speeds(step, robot)]
    for condition, mark in every_condition(mission):
        found += _compared(condition, mark, robot)
    return found


def setting_findings(
    mission: Mission, robot: RobotDescription, choices: Mapping[str, Choice]
) -> Iterator[Finding]:
    """Yield a warning for each speed that the mission or its files set above the robot's limit.

    Values of the robot file, the command line and defaults are not reported.
    """
    for kind, choice in choices.items():
        named = mission.components.get(kind)
        if named is None:
            continue
        parameters: type = type(choice.parameters)
        for name, declared in declarations(parameters).items():
            if not declared.robot_limit or name not in named.values:
                continue
            speed = getattr(choice.parameters, name)
            most = getattr(robot.limits, declared.robot_limit)
            if speed <= most + 1e-9 or not _is_set_to(speed, declared, named.values[name]):
                continue
            unit = declared.unit
            sentence = f"{kind}.{name}: {speed:g} {unit} is limited to {most:g} {unit} by the robot"
            hint = f"use at most {most:g} {unit}"
            mark = named.marks.get(name, named.mark)
            yield Finding(mark, "W141", f"{sentence} {robot.name}", hint)


def _is_set_to(speed: float, declared: Declaration, raw: object) -> bool:
    """Return whether the speed is the mission's, not one of the command line."""
    try:
        return bool(declared.read(raw) == speed)
    except ParameterError:
        return False  # another component accepted it


def _compared(
    condition: CheckedExpression, mark: Mark, robot: RobotDescription
) -> Iterator[Finding]:
    """Report comparisons of the measured speed with one above the robot's limit."""
    limits = robot.limits
    forward = max(limits.linear_speed, limits.reverse_speed)
    limit = {"robot.speed": hypot(forward, limits.lateral_speed),
             "robot.turning": limits.angular_speed}  # fmt: skip
    known = {name: Interval(0.0, most * MEASURED) for name, most in limit.items()}
    for part in comparisons(condition.term):
        named = next((t.name for t in (part.left, part.right) if isinstance(t, Named)), "")
        truth = truth_values(part, known)
        if named not in limit or len(truth) != 1 or len(truth_values(part)) == 1:
            continue
        word, unit = "always" if True in truth else "never", ROBOT_VALUES[named].type.unit
        sentence = f"{text_of_comparison(part) or condition.source} is {word} true: {robot.name} "
        does = "drives" if named == "robot.speed" else "turns"
        sentence += f"{does} at most at {limit[named]:g} {unit}"
        yield Finding(mark, "W141", sentence, "compare it with a speed that it can reach")


def _speeds(step: Step, robot: RobotDescription) -> Iterator[Finding]:
    """Report speeds that the robot cannot reach."""
    if not isinstance(step, LeafStep) or "base" not in step.claims:
        return
    limits = robot.limits
    for name, value in step.ports.items():
        declared, speed = step.behaviour.ports[name], number_of(value)
        if speed is None or declared.unit not in ("m/s", "rad/s"):
            continue
        most, what = limits.angular_speed, "turns"
        if declared.unit == "m/s":
            backward = speed < 0.0 or step.behaviour.drives_backward
            most = limits.reverse_speed if backward else limits.linear_speed
            what = "drives backward" if backward else "drives"
        if abs(speed) <= most + 1e-9:
            continue
        unit = declared.unit
        sentence = f"{name}: {speed:g} {unit} is too fast for {robot.name}, which {what} "
        sentence += f"at most at {most:g} {unit}"
        hint = f"use at most {most:g} {unit}"
        is_bare = is_literal(value) and _is_number(value)
        if unit == "rad/s" and speed > 6.3 and is_bare:
            hint = f"write {speed:g} deg/s, or at most {most:g} rad/s"
        yield Finding(mark_of(value, step.mark), "W141", sentence, hint)


def _is_number(value: Value) -> bool:
    """Return whether the value is written without a unit."""
    return isinstance(value, Constant) and value.text.strip("+-.0123456789") == ""
