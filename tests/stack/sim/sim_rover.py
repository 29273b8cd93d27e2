"""A small rover and a square room for the simulation's tests."""

from dataclasses import replace
from math import pi
from pathlib import Path as FilePath

import numpy as np

from stack.body import BodyCommand
from stack.drivetrain.description import (
    CameraDescription,
    ImuDescription,
    LidarDescription,
    RobotDescription,
)
from stack.drivetrain.differential import Wheels
from stack.sim.worlds.world import Wall, World
from stack.types import CameraModel, Footprint, Pose2D

URDF = FilePath(__file__).with_name("rover.urdf")

LIDAR = LidarDescription(Pose2D(0.1, 0.0), height=0.2, noise=0.0, dropout=0.0)
CAMERA = CameraDescription(CameraModel(320, 240, 280.0, (0.15, 0.0, 0.25)), noise=0.0)

ROVER = RobotDescription(
    "rover",
    Footprint(np.array([[-0.18, -0.24], [0.18, -0.24], [0.18, 0.24], [-0.18, 0.24]])),
    0.25,
    URDF,
    Wheels(("left_wheel_joint",), ("right_wheel_joint",), 0.08, 0.32),
    model=URDF.read_text("utf-8"),
)

EQUIPPED = replace(
    ROVER,
    lidar=replace(LIDAR, noise=0.01, dropout=0.005),
    imu=ImuDescription(),
    camera=replace(CAMERA, noise=2.0),
)

EMPTY = World("empty", (-10.0, -10.0, 10.0, 10.0))


def square_room(half: float, **more) -> World:
    """Inner walls at x, y = +-half: centre lines 5 cm farther out, 10 cm thick."""
    far = half + 0.05
    points = np.array([[-far, -far], [far, -far], [far, far], [-far, far], [-far, -far]])
    return World("room", (-far, -far, far, far), walls=(Wall(points),), **more)


def square_range(x: float, y: float, angle: float, half: float) -> float:
    """Distance from a point to the walls of the square room along a direction."""
    c, s = np.cos(angle), np.sin(angle)
    to_x = (np.copysign(half, c) - x) / c if abs(c) > 1e-12 else np.inf
    to_y = (np.copysign(half, s) - y) / s if abs(s) > 1e-12 else np.inf
    return min(to_x, to_y)


def drive(body, twist, seconds, period=0.05):
    """Command a velocity for a while; the observations on the way."""
    seen = []
    for _ in range(round(seconds / period)):
        body.command(BodyCommand(twist))
        body.wait(period)
        seen.append(body.sense())
    return seen


QUARTER = pi / 2
