"""What expressions may ask of the robot, by name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import hypot, inf, pi
from typing import Any, Protocol

from missions.language.expressions.value_types import BOOL, INT, NUMBER, POSE, TEXT, ValueType
from stack.robot import Robot


class EvaluationContext(Protocol):
    """What a running tree lets its expressions see."""

    @property
    def robot(self) -> Robot:
        """The robot that the tree drives."""
        ...

    @property
    def error(self) -> str:
        """Code of the last failure that a recover or a fallback dealt with; "" before any."""
        ...


@dataclass(frozen=True, slots=True)
class RobotValue:
    """A named value with its type, how to read it, and what a number lies between."""

    type: ValueType
    read: Callable[[EvaluationContext], Any]
    help: str
    least: float = -inf
    most: float = inf


ROBOT_VALUES: dict[str, RobotValue] = {
    "time": RobotValue(
        ValueType(float, "s"),
        lambda s: s.robot.time,
        "the robot's clock; 0 when the run began",
        least=0.0,
    ),
    "battery.charge": RobotValue(
        NUMBER, lambda s: s.robot.battery.charge, "state of charge in [0, 1]", 0.0, 1.0
    ),
    "battery.charging": RobotValue(
        BOOL, lambda s: s.robot.battery.charging, "whether it is being charged"
    ),
    "robot.speed": RobotValue(
        ValueType(float, "m/s"),
        lambda s: hypot(s.robot.speed.linear, s.robot.speed.lateral),
        "measured speed whichever way, never below 0",
        least=0.0,
    ),
    "robot.turning": RobotValue(
        ValueType(float, "rad/s"),
        lambda s: abs(s.robot.speed.angular),
        "measured rate of turn, never below 0",
        least=0.0,
    ),
    "localisation.health": RobotValue(
        NUMBER,
        lambda s: s.robot.localisation_health,
        "fit of the scan to the map in [0, 1]",
        0.0,
        1.0,
    ),
    "localisation.deviation": RobotValue(
        ValueType(float, "m"),
        lambda s: s.robot.estimate.position_deviation,
        "standard deviation of the position along its worst direction",
        least=0.0,
    ),
    "pose": RobotValue(POSE, lambda s: s.robot.pose, "where the robot believes it is"),
    "pose.x": RobotValue(ValueType(float, "m"), lambda s: s.robot.pose.x, "in the map frame"),
    "pose.y": RobotValue(ValueType(float, "m"), lambda s: s.robot.pose.y, "in the map frame"),
    "pose.heading": RobotValue(
        ValueType(float, "rad"),
        lambda s: s.robot.pose.heading,
        "in the map frame",
        -pi,
        pi,
    ),
    "error": RobotValue(
        TEXT,
        lambda s: s.error,
        "code of the failure being dealt with; in `unless`, recoveries and later alternatives",
    ),
    "attempt": RobotValue(
        INT,
        lambda s: 0,
        "number of the attempt under way, from 1; inside retry and recover",
        least=1,
    ),
}
"""`attempt` is bound by the compiler to the retry or recover around the expression."""

DISTANCE = "pose.distance_to"
"""The one function: distance in metres from the robot to a pose."""
