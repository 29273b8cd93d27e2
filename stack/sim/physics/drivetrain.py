"""What the physics needs to know of a robot's wheels: which joints, how strong, how they roll."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from stack.drivetrain.description import OmniWheels, RobotDescription, SteeredWheels, Wheels
from stack.errors import BodyError

TORQUE_RESERVE = 3.0
"""A wheel motor's strength over what the acceleration limits need on the level."""

STEERING_TORQUE = 20.0
"""Newton metres that hold a steered wheel at its angle; wheels that roll resist with less."""


@dataclass(frozen=True, slots=True)
class Drivetrain:
    """Joints of a robot by what they do, as PyBullet's numbers.

    Attributes:
        driven: wheels with motors, in the order of the description.
        steering: joints that turn wheels about the vertical, left and right.
        rolling: joints of wheels without motors.
        mass: of the whole robot, kilograms.
        torque: of a wheel's motor, newton metres.
        rollers: whether driven wheels slide freely along their own axles.
    """

    driven: list[int]
    steering: list[int]
    rolling: list[int]
    mass: float
    torque: float
    rollers: bool

    @property
    def tyres(self) -> list[int]:
        """Wheels that grip the floor, those with motors first."""
        return self.driven + self.rolling


def find_drivetrain(
    description: RobotDescription, bullet: Any, client: int, robot: int
) -> Drivetrain:
    """The running gear of a robot that was loaded.

    Raises:
        BodyError: the URDF lacks a joint that the description names.
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
            f"it has {', '.join(sorted(links))}"
        )
    driven, steered = [links[name] for name in names], [links[name] for name in steering]
    turning = [info[0] for info in infos if info[2] == bullet.JOINT_REVOLUTE]
    rolling = [link for link in turning if link not in (*driven, *steered)]
    every = range(-1, count)
    mass = sum(bullet.getDynamicsInfo(robot, link, physicsClientId=client)[0] for link in every)
    rollers = isinstance(wheels, OmniWheels)
    return Drivetrain(driven, steered, rolling, mass, _torque(description, mass), rollers)


def driven_joints(description: RobotDescription) -> tuple[str, ...]:
    """URDF joints of the wheels with motors, in the order that drives and encoders use."""
    wheels = description.wheels
    if isinstance(wheels, Wheels):
        return wheels.left + wheels.right
    return wheels.joints if isinstance(wheels, OmniWheels) else wheels.rear


def _torque(description: RobotDescription, mass: float) -> float:
    """Motor strength of one wheel: all accelerations at once, with a reserve."""
    limits, wheels = description.limits, description.wheels
    linear = mass * max(limits.linear_acceleration, limits.linear_deceleration)
    inertia = mass * description.footprint.circumscribed_radius**2 / 2.0
    if isinstance(wheels, Wheels):
        turning = 2.0 * inertia * limits.angular_acceleration / wheels.separation
        count = len(wheels.left) + len(wheels.right)
        return TORQUE_RESERVE * (linear + turning) * wheels.radius / count
    if isinstance(wheels, OmniWheels):
        # The least wheel forces f that push the base with F: f = pinv(J') F.
        push = np.array([linear, linear, inertia * limits.angular_acceleration])
        strongest = float((np.abs(np.linalg.pinv(wheels.jacobian.T)) @ push).max())
        return TORQUE_RESERVE * strongest * wheels.radius
    return TORQUE_RESERVE * linear * wheels.radius / len(wheels.rear)
