"""Sets robot values of a scripted robot, by their names in missions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from behaviours.testing import ScriptedRobot
from stack.types import Detection, Pose2D, RivalPose


def set_value(robot: ScriptedRobot, name: str, value: Any) -> None:
    """Set the robot value with this name; `time`, `error` and `attempt` cannot be set."""
    _SETTERS[name](robot, value)


def _deviation(robot: ScriptedRobot, value: float) -> None:
    robot.covariance = np.diag([value**2, value**2, robot.covariance[2, 2]])


def _ambiguous(robot: ScriptedRobot, value: bool) -> None:
    robot.rivals = (RivalPose(Pose2D(0.0, 0.0), 0.5),) if value else ()


def _part(whole: str, field: str) -> Callable[[ScriptedRobot, Any], None]:
    """Return the function that replaces a field of one of the robot's records."""

    def write(robot: ScriptedRobot, value: Any) -> None:
        setattr(robot, whole, replace(getattr(robot, whole), **{field: value}))

    return write


def _plain(field: str) -> Callable[[ScriptedRobot, Any], None]:
    return lambda robot, value: setattr(robot, field, value)


def _detected(robot: ScriptedRobot, labels: list[str]) -> None:
    robot.objects = tuple(
        Detection(label, robot.time, (0.0, 0.0), 0.1, 0.5, 1.0, (0, 0, 1, 1)) for label in labels
    )


_SETTERS: dict[str, Callable[[ScriptedRobot, Any], None]] = {
    "battery.charge": _part("battery", "charge"),
    "battery.charging": _part("battery", "charging"),
    "robot.speed": _part("speed", "linear"),
    "robot.turning": _part("speed", "angular"),
    "localisation.health": _plain("health"),
    "localisation.deviation": _deviation,
    "localisation.ambiguous": _ambiguous,
    "detected": _detected,
    "pose": _plain("pose"),
    "pose.x": _part("pose", "x"),
    "pose.y": _part("pose", "y"),
    "pose.heading": _part("pose", "heading"),
}
