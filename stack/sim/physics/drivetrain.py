"""A robot's wheels in PyBullet: joint numbers, motor torque, rollers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from stack.drivetrain.description import OmniWheels, RobotDescription, SteeredWheels, Wheels
from stack.errors import BodyError

TORQUE_RESERVE = 3.0
"""Ratio of motor torque to the torque that the acceleration limits need on level ground."""

STEERING_TORQUE = 20.0
"""Torque, N m, that holds a steered wheel at its angle; more than rolling wheels resist with."""


@dataclass(frozen=True, slots=True)
class Drivetrain:
    """Joints of a robot by function, as PyBullet joint numbers, with mass and motor torque.

    Attributes:
        driven: wheels with motors, in the order of the description.
        steering: joints that turn wheels about the vertical axis, left and right.
        rolling: joints of wheels without motors.
        mass: of the whole robot, kilograms.
        torque: of one wheel motor, newton metres.
        rollers: whether driven wheels slide freely along their axles.
    """

    driven: list[int]
    steering: list[int]
    rolling: list[int]
    mass: float
    torque: float
    rollers: bool

    @property
    def tyres(self) -> list[int]:
        """Wheels with friction on the floor, driven wheels first."""
        return self.driven + self.rolling


def find_drivetrain(
    description: RobotDescription, bullet: Any, client: int, robot: int
) -> Drivetrain:
    """Return the drivetrain of a loaded robot.

    Raises:
        BodyError: the description names a joint that the URDF does not have.
    """
    count = bullet.getNumJoints(robot, physicsClientId=client)
    infos = [bullet.getJointInfo(robot, n, physicsClientId=client) for n in range(count)]
    links = {info[1].decode(): info[0] for info in infos}
    wheels = description.wheels
    steering = wheels.steering if isinstance(wheels, SteeredWheels) else ()
    names = driven_joints(description)
    missing = [name for name in (*names, *steering) if name not in links]
    if missing:
        raise BodyError(
            f"{description.urdf.name} has no wheel joint {missing[0]!r}; "
            f"its joints are {', '.join(sorted(links))}"
        )
    driven, steered = [links[name] for name in names], [links[name] for name in steering]
    turning = [info[0] for info in infos if info[2] == bullet.JOINT_REVOLUTE]
    rolling = [link for link in turning if link not in (*driven, *steered)]
    all_links = range(-1, count)
    mass = sum(bullet.getDynamicsInfo(robot, link, physicsClientId=client)[0] for link in all_links)
    rollers = isinstance(wheels, OmniWheels)
    return Drivetrain(driven, steered, rolling, mass, _torque(description, mass), rollers)


def driven_joints(description: RobotDescription) -> tuple[str, ...]:
    """URDF joints of the driven wheels, in the order of wheel controllers and encoders."""
    wheels = description.wheels
    if isinstance(wheels, Wheels):
        return wheels.left + wheels.right
    return wheels.joints if isinstance(wheels, OmniWheels) else wheels.rear


def _torque(description: RobotDescription, mass: float) -> float:
    """Motor torque of one wheel, N m: for all acceleration limits at once, with a reserve."""
    limits, wheels = description.limits, description.wheels
    linear = mass * max(limits.linear_acceleration, limits.linear_deceleration)
    inertia = mass * description.footprint.circumscribed_radius**2 / 2.0
    if isinstance(wheels, Wheels):
        turning = 2.0 * inertia * limits.angular_acceleration / wheels.separation
        count = len(wheels.left) + len(wheels.right)
        return TORQUE_RESERVE * (linear + turning) * wheels.radius / count
    if isinstance(wheels, OmniWheels):
        # The smallest wheel forces f that produce the wrench F on the base: f = pinv(J') F.
        push = np.array([linear, linear, inertia * limits.angular_acceleration])
        strongest = float((np.abs(np.linalg.pinv(wheels.jacobian.T)) @ push).max())
        return TORQUE_RESERVE * strongest * wheels.radius
    return TORQUE_RESERVE * linear * wheels.radius / len(wheels.rear)
