"""Forward kinematics of each kind of drive: motion of the base from the motion of the wheels."""

from __future__ import annotations

from collections.abc import Sequence
from math import tan
from typing import Protocol

import numpy as np

from stack.drivetrain.description import OmniWheels, RobotDescription, SteeredWheels, Wheels
from stack.types import Pose2D


class ForwardKinematics(Protocol):
    """Forward kinematics of one kind of drive."""

    @property
    def count(self) -> int:
        """Number of encoders."""
        ...

    def wheel_angles(self, wheels: Sequence[float]) -> Sequence[float]:
        """Encoder angles from the angles of all driven wheels, radians."""
        ...

    def steer(self, angles: Sequence[float]) -> None:
        """Set the angles of the steered wheels, left and right, radians."""
        ...

    def moved(self, rolled: Sequence[float], slips: Sequence[float]) -> Pose2D:
        """Displacement of the base in its own frame.

        Args:
            rolled: distance rolled at each encoder, metres; with speeds in m/s the result is a
                velocity.
            slips: distance that each wheel slipped in addition, in the same unit.
        """
        ...


class DifferentialKinematics:
    """Differential drive: mean of each side; turn = (right - left) / separation."""

    count = 2

    def __init__(self, wheels: Wheels) -> None:
        self._left, self._separation = len(wheels.left), wheels.separation

    def wheel_angles(self, wheels: Sequence[float]) -> Sequence[float]:
        """Mean angle of each side, left and right."""
        left, right = wheels[: self._left], wheels[self._left :]
        return sum(left) / len(left), sum(right) / len(right)

    def steer(self, angles: Sequence[float]) -> None:
        """Ignored: this drive has no steered wheels."""

    def moved(self, rolled: Sequence[float], slips: Sequence[float]) -> Pose2D:
        """Displacement forward and in heading, none sideways."""
        left, right = rolled[0] + slips[0], rolled[1] + slips[1]
        return Pose2D((left + right) / 2.0, 0.0, (right - left) / self._separation)


class OmniKinematics:
    """Omnidirectional drive: pseudo-inverse of the Jacobian, a least-squares solution if n > 3.

    P. F. Muir and C. P. Neuman, "Kinematic Modeling of Wheeled Mobile Robots", Journal of Robotic
    Systems 4(2), 1987.
    """

    def __init__(self, wheels: OmniWheels) -> None:
        self.count = len(wheels.joints)
        inverse = np.linalg.pinv(wheels.jacobian)
        self._rows: list[list[float]] = inverse.tolist()

    def wheel_angles(self, wheels: Sequence[float]) -> Sequence[float]:
        """The angle of each wheel."""
        return wheels

    def steer(self, angles: Sequence[float]) -> None:
        """Ignored: this drive has no steered wheels."""

    def moved(self, rolled: Sequence[float], slips: Sequence[float]) -> Pose2D:
        """Displacement forward, to the left and in heading."""
        distances = [roll + slip for roll, slip in zip(rolled, slips, strict=True)]
        forward, left, turn = (
            sum(gain * distance for gain, distance in zip(row, distances, strict=True))
            for row in self._rows
        )
        return Pose2D(forward, left, turn)


class AckermannKinematics:
    """Ackermann drive: distance from the rear wheels, curvature from the steering angles.

    Different slips of the two rear wheels also turn the car.
    """

    count = 2

    def __init__(self, wheels: SteeredWheels) -> None:
        self._wheels, self._curvature = wheels, 0.0

    def wheel_angles(self, wheels: Sequence[float]) -> Sequence[float]:
        """Angles of the left and the right rear wheel."""
        return wheels

    def steer(self, angles: Sequence[float]) -> None:
        """Set the curvature to the mean of those of the two front wheels."""
        half, base = self._wheels.track / 2.0, self._wheels.wheelbase
        left, right = (tan(angle) for angle in angles)
        self._curvature = (left / (base + half * left) + right / (base - half * right)) / 2.0

    def moved(self, rolled: Sequence[float], slips: Sequence[float]) -> Pose2D:
        """Displacement forward and in heading, none sideways."""
        forward = (rolled[0] + rolled[1]) / 2.0
        slipped = (slips[0] + slips[1]) / 2.0
        turn = forward * self._curvature + (slips[1] - slips[0]) / self._wheels.track
        return Pose2D(forward + slipped, 0.0, turn)


def forward_kinematics_of(robot: RobotDescription) -> ForwardKinematics:
    """Return the forward kinematics of a robot's drive."""
    wheels = robot.wheels
    if isinstance(wheels, Wheels):
        return DifferentialKinematics(wheels)
    if isinstance(wheels, OmniWheels):
        return OmniKinematics(wheels)
    return AckermannKinematics(wheels)
