"""`python -m tests.benchmarks.robot_pictures FILE.png`: every robot that comes along, side by side.

Drawn by PyBullet's software renderer, from the URDFs alone.
"""

from __future__ import annotations

import sys
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from robots.load import find_robot, read_robot, robot_names
from stack.drivetrain.ackermann import SteeredWheels
from stack.drivetrain.description import RobotDescription
from stack.sim.physics.pybullet_engine import loader
from stack.sim.physics.pybullet_engine.robot import load_robot

SIZE = (560, 460)
SIGHT = (1.15, -28.0, 130.0)
"""Distance in metres, angle upward and about the robot in degrees."""


def portrait(robot: RobotDescription) -> NDArray[np.uint8]:
    """The robot (height, width, 3) RGB, seen from ahead and its left; a car steers a little."""
    bullet = loader.load()
    client = bullet.connect(bullet.DIRECT)
    body = load_robot(bullet, client, robot.model)
    steering = robot.wheels.steering if isinstance(robot.wheels, SteeredWheels) else ()
    for joint in range(bullet.getNumJoints(body, physicsClientId=client)):
        if bullet.getJointInfo(body, joint, physicsClientId=client)[1].decode() in steering:
            bullet.resetJointState(body, joint, 0.45, physicsClientId=client)
    middle = robot.footprint.points[:, 0]
    target = [float(middle.min() + middle.max()) / 2.0, 0.0, 0.17]
    distance, pitch, yaw = SIGHT
    view = bullet.computeViewMatrixFromYawPitchRoll(target, distance, yaw, pitch, 0.0, 2)
    lens = bullet.computeProjectionMatrixFOV(40.0, SIZE[0] / SIZE[1], 0.05, 10.0)
    _, _, pixels, _, _ = bullet.getCameraImage(
        *SIZE, view, lens, shadow=1, lightDirection=[1.0, 1.5, 3.0],
        renderer=bullet.ER_TINY_RENDERER, physicsClientId=client,
    )  # fmt: skip
    bullet.disconnect(physicsClientId=client)
    return np.asarray(pixels, np.uint8).reshape(SIZE[1], SIZE[0], 4)[:, :, :3].copy()


def main() -> None:
    """Draw them all into one picture."""
    shots = []
    for name in robot_names():
        shot = portrait(read_robot(find_robot(name, Path())))
        cv2.putText(shot, name, (16, 36), cv2.FONT_HERSHEY_SIMPLEX, 0.9, (60, 60, 60), 2)
        shots.append(shot)
    cv2.imwrite(sys.argv[1], np.hstack(shots)[:, :, ::-1])


if __name__ == "__main__":
    main()
