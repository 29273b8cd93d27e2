"""Turning the camera in the hand to something."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, pi, sin

import numpy as np
from py_trees.common import Status

from behaviours._arm.acting import MOTION_FAILURES, ArmBehaviour
from behaviours._arm.blocks import TURNS, nearest_first
from behaviours._motion.driving import Steps
from behaviours.base import port
from stack.errors import ParameterError
from stack.parameters import parameter
from stack.types import OBJECT_COLOURS, FailureCode, FloatArray


@dataclass(frozen=True)
class Point:
    """A point in the arm's base link: x forward, y left, z up from where the arm is mounted."""

    x: float = parameter(0.0, "m", help="forward")
    y: float = parameter(0.0, "m", help="to the left")
    z: float = parameter(0.0, "m", help="upwards")


class LookAt(ArmBehaviour):
    """Turn the camera in the hand to a point or a block.

    The camera moves to a distance from it, on the side of the arm unless `azimuth` says otherwise,
    so that the point is in the middle of its picture. Fails with OBJECT_NOT_FOUND if no such block
    was detected, UNSUPPORTED without a camera in the hand, and as `move_arm` does.
    """

    point: Point | None = port("to look at, in the arm's base link", default=None)
    block: str | None = port(
        "instead: colour of the nearest block that was detected", default=None,
        one_of=OBJECT_COLOURS,
    )  # fmt: skip
    distance: float = port("of the camera", unit="m", default=0.35, above=0.0, at_most=2.0)
    azimuth: float | None = port(
        "direction from the point to the camera, from above; default: to the arm", unit="rad",
        default=None,
    )  # fmt: skip
    elevation: float = port(
        "of the camera over the point; 90 deg: straight down", unit="rad", default=pi / 3.0,
        at_least=-pi / 2.0, at_most=pi / 2.0,
    )  # fmt: skip
    roll: float | None = port(
        "turn about the view, 0: upright; default: the first of 0, 90, 180, -90 deg that is free",
        unit="rad", default=None,
    )  # fmt: skip
    speed: float = port("share of the top speed", default=1.0, above=0.0, at_most=1.0)

    claims = ("arm",)
    one_port_of = ("point", "block")
    fails_with = (*MOTION_FAILURES, FailureCode.OBJECT_NOT_FOUND, FailureCode.UNSUPPORTED)

    def initialise(self) -> None:
        if (self.point is None) == (self.block is None):
            raise ParameterError("", "look_at needs exactly one of point and block")
        self._steps = self._look()

    def update(self) -> Status:
        return self.advance(self._steps)

    def _look(self) -> Steps:
        arm, target = self.robot.arm, self._target()
        if arm.camera_in_tool is None:
            self.fail(FailureCode.UNSUPPORTED, "no camera is in the hand")
            return False
        if target is None:
            self.fail(FailureCode.OBJECT_NOT_FOUND, f"no {self.block} block was detected")
            return False
        tool_from_camera = np.linalg.inv(arm.camera_in_tool)
        for roll in TURNS if self.roll is None else (self.roll,):
            view = looking_at(target, self.distance, self._azimuth(target), self.elevation, roll)
            motion = arm.move_tool(view @ tool_from_camera, speed=self.speed)
            if (yield from self.done(motion, "looking")):
                return True
            if not self.is_unplanned:
                break
        return False

    def _target(self) -> FloatArray | None:
        """(3,) base link, metres; None if no such block is known."""
        if self.point is not None:
            return np.array([self.point.x, self.point.y, self.point.z])
        blocks = self.robot.arm.blocks.values()
        found = nearest_first(block for block in blocks if block.colour == self.block)
        return found[0].pose[:3, 3] if found else None

    def _azimuth(self, target: FloatArray) -> float:
        towards_arm = float(np.arctan2(-target[1], -target[0]))
        return towards_arm if self.azimuth is None else self.azimuth


def looking_at(
    target: FloatArray, distance: float, azimuth: float, elevation: float, roll: float
) -> FloatArray:
    """Return the pose (4, 4) of a camera that looks at a point: x right, y down, z forward.

    Args:
        target: (3,) the point, metres.
        distance: of the camera, metres.
        azimuth: direction from the point to the camera, seen from above, radians.
        elevation: of the camera over the point, radians.
        roll: clockwise turn of the camera about its view, radians.
    """
    level = np.array([cos(azimuth), sin(azimuth), 0.0])
    away = cos(elevation) * level + np.array([0.0, 0.0, sin(elevation)])
    right = np.array([-level[1], level[0], 0.0])  # of a view along -away
    down = np.cross(-away, right)
    pose = np.eye(4)
    pose[:3, 0] = cos(roll) * right + sin(roll) * down
    pose[:3, 1] = cos(roll) * down - sin(roll) * right
    pose[:3, 2] = -away
    pose[:3, 3] = target + distance * away
    return pose
