"""Obstacle points as a standing robot receives them, and drives through the safety stage."""

from __future__ import annotations

from math import inf
from typing import Any

import numpy as np

from stack.drivetrain.description import RobotDescription
from stack.frames.buffer import TransformBuffer
from stack.perception.obstacle_memory import ObstacleMemory
from stack.safety.safety import Safety
from stack.types import (
    NOTHING_MOVES,
    STANDSTILL,
    FloatArray,
    Observation,
    ObstaclePoints,
    Odometry,
    Perceived,
    Pose2D,
    PoseEstimate,
    Scan,
    Twist,
    WorldView,
)
from tests.stack.navigation.toy_world import ToyWorld


class SafetyStage(Safety):
    """The safety stage, with only the inputs that a test states.

    Attributes:
        reason: why the last velocity was limited.
    """

    reason = ""

    def limit(
        self, twist: Twist, motion: Odometry, obstacles: ObstaclePoints, *,
        moving: FloatArray = NOTHING_MOVES, speed_limit: float = inf, **more: Any,
    ) -> Twist:  # fmt: skip
        estimate = PoseEstimate(motion.pose, np.eye(3) * 1e-4, 1.0)
        world = WorldView(moving=moving, speed_limit=speed_limit)
        perceived = Perceived(motion.stamp, estimate, motion, obstacles, world=world)
        limited = super().limit(twist, perceived, **more)
        self.reason = limited.reason
        return limited.twist


STILL = 10
"""Steps of standstill after which a robot in a toy world stays where it is: nothing there changes,
and after five scans of the same pose safety decides the same again."""


def standing(time: float = 0.0) -> Odometry:
    return Odometry(time, Pose2D(0.0, 0.0), STANDSTILL)


def seen(robot: RobotDescription, time: float = 0.0, **scans: Scan) -> ObstaclePoints:
    """What a robot that stands still sees at a time with its newest scans, by lidar."""
    frames = TransformBuffer()
    for stamp in sorted({min([time, *(scan.stamp for scan in scans.values())]), time}):
        frames.add(standing(stamp))
    return ObstacleMemory(robot).update(Observation(time, scans), frames)


def drive_until_still(world: ToyWorld, safety: SafetyStage, wanted: Twist, seconds: float) -> None:
    """Drive with one wish for some seconds, or until the robot stands for good."""
    still = 0
    for _ in range(round(seconds / world.period)):
        twist = safety.limit(wanted, world.odometry, world.obstacles)
        world.drive(twist)
        still = still + 1 if twist == STANDSTILL else 0
        if still == STILL:
            return
