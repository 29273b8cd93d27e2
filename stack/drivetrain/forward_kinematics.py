"""How far the base moves when the wheels have rolled, for each kind of robot."""

from __future__ import annotations

from collections.abc import Sequence
from math import tan
from typing import Protocol

import numpy as np

from stack.drivetrain.description import OmniWheels, RobotDescription, SteeredWheels, Wheels
from stack.types import Pose2D


class ForwardKinematics(Protocol):
    """The forward kinematics of one kind of wheels."""

    @property
    def count(self) -> int:
        """How many encoders count."""
        ...

    def wheel_angles(self, wheels: Sequence[float]) -> Sequence[float]:
        """What the encoders show, from the angle of every driven wheel, radians."""
        ...

    def steer(self, angles: Sequence[float]) -> None:
        """Note the angles of the steered wheels, left and right, radians."""
        ...

    def moved(self, rolled: Sequence[float], slips: Sequence[float]) -> Pose2D:
        """The base's displacement in its own frame.

        Args:
            rolled: metres at each encoder; or m/s, and the displacement is a velocity.
            slips: metres that each wheel went beyond that.
        """
        ...


class DifferentialKinematics:
    """Left and right, each the mean over its side; turn = (right - left) / separation."""

    count = 2

    def __init__(self, wheels: Wheels) -> None:
        self._left, self._separation = len(wheels.left), wheels.separation

    def wheel_angles(self, wheels: Sequence[float]) -> Sequence[float]:
        """The mean angle of each side."""
        left, right = wheels[: self._left], wheels[self._left :]
        return sum(left) / len(left), sum(right) / len(right)

    def steer(self, angles: Sequence[float]) -> None:
        """Nothing is steered."""

    def moved(self, rolled: Sequence[float], slips: Sequence[float]) -> Pose2D:
        """Forward and turned; never sideways."""
        left, right = rolled[0] + slips[0], rolled[1] + slips[1]
        return Pose2D((left + right) / 2.0, 0.0, (right - left) / self._separation)


class OmniKinematics:
    """The pseudo-inverse of the wheels' Jacobian: least squares where there are more than three.

    P. F. Muir and C. P. Neuman, "Kinematic Modeling of Wheeled Mobile Robots", Journal of Robotic
    Systems 4(2), 1987.
    """

    def __init__(self, wheels: OmniWheels) -> None:
        self.count = len(wheels.joints)
        inverse = np.linalg.pinv(wheels.jacobian)
        self._rows: list[list[float]] = inverse.tolist()

    def wheel_angles(self, wheels: Sequence[float]) -> Sequence[float]:
        """Every wheel's own."""
        return wheels

    def steer(self, angles: Sequence[float]) -> None:
        """Nothing is steered."""

    def moved(self, rolled: Sequence[float], slips: Sequence[float]) -> Pose2D:
        """In all three directions."""
        ways = [way + slip for way, slip in zip(rolled, slips, strict=True)]
        forward, left, turn = (
            sum(gain * way for gain, way in zip(row, ways, strict=True)) for row in self._rows
        )
        return Pose2D(forward, left, turn)


class AckermannKinematics:
    """The rear wheels say how far, the steering says on which arc.

    Where the two rear wheels slip unlike each other the car turns, though no encoder says so.
    """

    count = 2

    def __init__(self, wheels: SteeredWheels) -> None:
        self._wheels, self._curvature = wheels, 0.0

    def wheel_angles(self, wheels: Sequence[float]) -> Sequence[float]:
        """Of the left and the right rear wheel."""
        return wheels

    def steer(self, angles: Sequence[float]) -> None:
        """Take the arc as the mean of what the two front wheels say."""
        half, base = self._wheels.track / 2.0, self._wheels.wheelbase
        left, right = (tan(angle) for angle in angles)
        self._curvature = (left / (base + half * left) + right / (base - half * right)) / 2.0

    def moved(self, rolled: Sequence[float], slips: Sequence[float]) -> Pose2D:
        """Forward and turned; never sideways."""
        forward = (rolled[0] + rolled[1]) / 2.0
        slipped = (slips[0] + slips[1]) / 2.0
        turn = forward * self._curvature + (slips[1] - slips[0]) / self._wheels.track
        return Pose2D(forward + slipped, 0.0, turn)


def forward_kinematics_of(robot: RobotDescription) -> ForwardKinematics:
    """The forward kinematics of a robot's wheels."""
    wheels = robot.wheels
    if isinstance(wheels, Wheels):
        return DifferentialKinematics(wheels)
    if isinstance(wheels, OmniWheels):
        return OmniKinematics(wheels)
    return AckermannKinematics(wheels)
