"""A robot's wheels in PyBullet: joint numbers, motor torque, rollers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from stack.drivetrain.description import RobotDescription
from stack.errors import BodyError

TORQUE_RESERVE = 3.0
"""Ratio of motor torque to the torque that the acceleration limits need on level ground."""

STEERING_TORQUE = 20.0
"""Torque, N m, that holds a steered wheel at its angle; more than rolling wheels resist with."""


@dataclass(frozen=True, slots=True)
class DriveJoints:
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


def find_drive_joints(
    description: RobotDescription, bullet: Any, client: int, robot: int
) -> DriveJoints:
    """Return the joints of a loaded robot.

    Raises:
        BodyError: the description names a joint that the URDF does not have.
    """
    count = bullet.getNumJoints(robot, physicsClientId=client)
    infos = [bullet.getJointInfo(robot, n, physicsClientId=client) for n in range(count)]
    links = {info[1].decode(): info[0] for info in infos}
    drivetrain = description.drivetrain
    names = (*drivetrain.driven_joints, *drivetrain.steering_joints)
    missing = [name for name in names if name not in links]
    if missing:
        raise BodyError(
            f"{description.urdf.name} has no wheel joint {missing[0]!r}; "
            f"its joints are {', '.join(sorted(links))}"
        )
    driven = [links[name] for name in drivetrain.driven_joints]
    steered = [links[name] for name in drivetrain.steering_joints]
    of_arm = () if description.arm is None else description.arm.all_joints
    turning = [
        info[0]
        for info in infos
        if info[2] == bullet.JOINT_REVOLUTE and info[1].decode() not in of_arm
    ]
    rolling = [link for link in turning if link not in (*driven, *steered)]
    all_links = range(-1, count)
    mass = sum(bullet.getDynamicsInfo(robot, link, physicsClientId=client)[0] for link in all_links)
    torque, rollers = _torque(description, mass), drivetrain.slides_along_axles
    return DriveJoints(driven, steered, rolling, mass, torque, rollers)


def _torque(description: RobotDescription, mass: float) -> float:
    """Motor torque of one wheel, N m: for all acceleration limits at once, with a reserve."""
    limits, wheels = description.limits, description.wheels
    force = mass * max(limits.linear_acceleration, limits.linear_deceleration)
    inertia = mass * description.footprint.circumscribed_radius**2 / 2.0
    moment = inertia * limits.angular_acceleration
    return TORQUE_RESERVE * description.drivetrain.wheel_force(force, moment) * wheels.radius
