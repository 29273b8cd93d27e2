"""Values of the robot that expressions can read, by name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import hypot, inf, pi
from typing import Any, Protocol

from missions.language.expressions.value_types import (
    ANGLE,
    BOOL,
    DURATION,
    INT,
    LENGTH,
    NUMBER,
    POSE,
    SHARE,
    TEXT,
    ValueType,
)
from stack.robot import Robot


class EvaluationContext(Protocol):
    """State of a running tree that expressions can read."""

    @property
    def robot(self) -> Robot:
        """The robot that the tree drives."""
        ...

    def describe(self, value: Any) -> str:
        """Format a value for people; a place is shown by its name."""
        ...


@dataclass(frozen=True, slots=True)
class RobotValue:
    """A named value: its type, how to read it, and the range of a number."""

    type: ValueType
    read: Callable[[EvaluationContext], Any]
    help: str
    least: float = -inf
    most: float = inf


ROBOT_VALUES: dict[str, RobotValue] = {
    "time": RobotValue(
        DURATION,
        lambda s: s.robot.time,
        "robot's clock; 0 at the start of the run",
        least=0.0,
    ),
    "battery.charge": RobotValue(
        SHARE, lambda s: s.robot.battery.charge, "state of charge in [0, 1]", 0.0, 1.0
    ),
    "battery.charging": RobotValue(
        BOOL, lambda s: s.robot.battery.charging, "whether the battery is charging"
    ),
    "robot.speed": RobotValue(
        ValueType(float, "m/s"),
        lambda s: hypot(s.robot.base.speed.linear, s.robot.base.speed.lateral),
        "absolute value of the measured linear speed",
        least=0.0,
    ),
    "robot.turning": RobotValue(
        ValueType(float, "rad/s"),
        lambda s: abs(s.robot.base.speed.angular),
        "absolute value of the measured angular speed",
        least=0.0,
    ),
    "localisation.health": RobotValue(
        SHARE,
        lambda s: s.robot.localisation.health,
        "health of the pose estimate in [0, 1]: fit of the scan to the map",
        0.0,
        1.0,
    ),
    "localisation.deviation": RobotValue(
        LENGTH,
        lambda s: s.robot.localisation.estimate.position_deviation,
        "standard deviation of the position in its least certain direction",
        least=0.0,
    ),
    "localisation.ambiguous": RobotValue(
        BOOL,
        lambda s: s.robot.localisation.estimate.ambiguous,
        "whether another pose explains the scans about as well as the estimate",
    ),
    "map.known_area": RobotValue(
        NUMBER,
        lambda s: s.robot.map.known_area,
        "area of the map's free and occupied cells, m²",
        least=0.0,
    ),
    "detected": RobotValue(
        ValueType(list, item=TEXT),
        lambda s: [item.label for item in s.robot.perception.detections() or ()],
        "labels of the objects in the newest picture that the object detector searched; reading it "
        "keeps camera and detector on",
    ),
    "recording.over": RobotValue(
        BOOL,
        lambda s: s.robot.recording_over,
        "whether all measurements of a replayed log have been played; else false",
    ),
    "pose": RobotValue(POSE, lambda s: s.robot.localisation.pose, "estimated pose, map frame"),
    "pose.x": RobotValue(
        LENGTH, lambda s: s.robot.localisation.pose.x, "x of the estimated pose, map frame"
    ),
    "pose.y": RobotValue(
        LENGTH, lambda s: s.robot.localisation.pose.y, "y of the estimated pose, map frame"
    ),
    "pose.heading": RobotValue(
        ANGLE,
        lambda s: s.robot.localisation.pose.heading,
        "heading of the estimated pose, map frame",
        -pi,
        pi,
    ),
    "error": RobotValue(
        TEXT,
        lambda s: "",
        "code of the failure that the innermost `recover` or fallback deals with; in `unless`, "
        "recoveries and later alternatives",
    ),
    "attempt": RobotValue(
        INT,
        lambda s: 0,
        "number of the current attempt, from 1; inside retry and recover",
        least=1,
    ),
}
"""The compiler binds `attempt` and `error` to the innermost node that counts or deals with them."""

DISTANCE = "pose.distance_to"
"""Distance from the robot to a pose, metres; `functions` has the functions with plain names."""
