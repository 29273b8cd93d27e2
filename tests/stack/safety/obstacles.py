"""Obstacle points as a standing robot receives them."""

from __future__ import annotations

from stack.drivetrain.description import RobotDescription
from stack.frames.buffer import TransformBuffer
from stack.perception.obstacle_memory import ObstacleMemory
from stack.types import STANDSTILL, Observation, ObstaclePoints, Odometry, Pose2D, Scan


def standing(time: float = 0.0) -> Odometry:
    return Odometry(time, Pose2D(0.0, 0.0), STANDSTILL)


def seen(robot: RobotDescription, time: float = 0.0, **scans: Scan) -> ObstaclePoints:
    """What a robot that stands still sees at a time with its newest scans, by lidar."""
    frames = TransformBuffer()
    for stamp in sorted({min([time, *(scan.stamp for scan in scans.values())]), time}):
        frames.add(standing(stamp))
    return ObstacleMemory(robot).update(Observation(time, scans), frames)
