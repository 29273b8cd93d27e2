"""Omnidirectional drive: wheels with rollers, which slide along their axles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import cos, hypot, sin
from typing import ClassVar

import numpy as np

from stack.drivetrain.drivetrain import DriveState, Drivetrain, Length, WheelGeometry, WheelLaw
from stack.drivetrain.limits import Limits
from stack.types import FloatArray, Pose2D, Twist


@dataclass(frozen=True)
class OmniWheels(WheelGeometry):
    """Three or more omnidirectional wheels: each drives in one direction and slides in the other.

    Attributes:
        joints: URDF joints, one for each wheel.
        mounts: contact point of each wheel, base frame; the heading is its driving direction.
        radius: metres.
        effective_lever: mean lever arm of the wheels about the base, as calibrated, metres; None:
            that of the mounts.
        effective_radii: of each wheel, as calibrated, metres.
    """

    joints: tuple[str, ...]
    mounts: tuple[Pose2D, ...]
    radius: float
    effective_lever: float | None = None
    effective_radii: tuple[float, ...] = ()
    turning_key: ClassVar[str] = "effective_lever"

    @property
    def turning_length(self) -> float:
        """The mean lever arm of the wheels."""
        if self.effective_lever is not None:
            return self.effective_lever
        return float(np.abs(self._levers).mean())

    @property
    def _levers(self) -> FloatArray:
        """(n,) lever arms of the mounts: metres rolled per radian that the base turns."""
        return np.array([m.x * sin(m.heading) - m.y * cos(m.heading) for m in self.mounts])

    @property
    def jacobian(self) -> FloatArray:
        """(n, 3) rolling speed of each wheel, m/s, per unit of linear, lateral, angular speed."""
        levers = self._levers
        if self.effective_lever is not None:
            levers = levers * (self.effective_lever / np.abs(levers).mean())
        return np.array([
            [cos(m.heading), sin(m.heading), lever]
            for m, lever in zip(self.mounts, levers.tolist(), strict=True)
        ])  # fmt: skip

    @property
    def places(self) -> Mapping[str, Pose2D]:
        """Contact points and driving directions of the wheels, base frame."""
        return dict(zip(self.joints, self.mounts, strict=True))

    def lengths(self, at: Mapping[str, tuple[float, float]]) -> Sequence[Length]:
        """Compare the coordinates of each mount with the URDF's."""
        return [
            Length("mounts", f"{axis} of the wheel {joint!r}", described, modelled)
            for joint, mount in self.places.items()
            for axis, described, modelled in zip("xy", (mount.x, mount.y), at[joint], strict=True)
        ]

    def drivetrain(self, limits: Limits) -> Drivetrain:
        """Return the drivetrain with these wheels."""
        return Omnidirectional(self, limits)


def share_of_change(  # noqa: PLR0913 - numba compiles it too (kernels.py)
    linear: float, lateral: float, to_linear: float, to_lateral: float,
    change: float, period: float, rise: float, fall: float,
) -> float:  # fmt: skip
    """Share of a change of velocity that one period allows, along a straight line; at most 1.

    Args:
        linear: m/s, now.
        lateral: m/s, now.
        to_linear: m/s, wanted.
        to_lateral: m/s, wanted.
        change: length of the change, m/s.
        period: seconds.
        rise: limit of speeding up, m/s².
        fall: limit of slowing down, m/s².
    """
    if change == 0.0:
        return 1.0
    ahead, left = to_linear - linear, to_lateral - lateral
    towards_zero = -(linear * ahead + lateral * left) / change
    slowing = min(max(towards_zero, 0.0), change)
    time = slowing / fall
    if time >= period:
        return fall * period / change
    return (slowing + rise * (period - time)) / change


class Omnidirectional(Drivetrain):
    """Omnidirectional drive: linear wheel kinematics with the Jacobian of the wheels.

    P. F. Muir and C. P. Neuman, "Kinematic Modeling of Wheeled Mobile Robots", Journal of Robotic
    Systems 4(2), 1987. With more than three wheels the motion of the base is the least-squares
    solution.
    """

    kind = "omni"
    can_move_sideways = True
    slides_along_axles = True

    def __init__(self, wheels: OmniWheels, limits: Limits) -> None:
        self._wheels = wheels
        super().__init__(wheels, limits)

    def feasible(self, twist: Twist) -> Twist:
        """Every twist is feasible."""
        return twist

    def limit_step(self, last: DriveState, wanted: Twist, period: float) -> DriveState:
        """Return the state after one period: the velocity changes along a straight line.

        On the part of the line that leads towards zero the drive slows down, on the rest it speeds
        up. All directions change at one rate, so that the robot does not swerve.
        """
        limits, now = self.limits, last.twist
        angular = limits.limit_angular(now.angular, wanted.angular, period)
        change = hypot(wanted.linear - now.linear, wanted.lateral - now.lateral)
        share = share_of_change(
            now.linear, now.lateral, wanted.linear, wanted.lateral, change, period,
            limits.linear_acceleration, limits.linear_deceleration,
        )  # fmt: skip
        if share >= 1.0:
            return DriveState(Twist(wanted.linear, angular, wanted.lateral))
        ahead, left = wanted.linear - now.linear, wanted.lateral - now.lateral
        return DriveState(Twist(now.linear + share * ahead, angular, now.lateral + share * left))

    @property
    def driven_joints(self) -> tuple[str, ...]:
        """URDF joints of all wheels."""
        return self._wheels.joints

    @property
    def law(self) -> WheelLaw:
        """Jacobian, already in rad/s."""
        rows = (self._wheels.jacobian / np.array(self.radii)[:, None]).tolist()
        return WheelLaw(tuple((x, y, turn) for x, y, turn in rows), 1.0, moves_sideways=True)

    @property
    def encoders(self) -> int:
        """One for each wheel."""
        return len(self._wheels.joints)

    def from_wheels(
        self, rolled: Sequence[float], slips: Sequence[float], steering: Sequence[float] = ()
    ) -> Pose2D:
        """Displacement forward, to the left and in heading."""
        distances = [roll + slip for roll, slip in zip(rolled, slips, strict=True)]
        forward, left, turn = (
            sum(gain * distance for gain, distance in zip(row, distances, strict=True))
            for row in self._motion_rows
        )
        return Pose2D(forward, left, turn)

    def wheel_force(self, force: float, moment: float) -> float:
        """The smallest wheel forces f that produce the wrench F on the base: f = pinv(J') F."""
        wrench = np.array([force, force, moment])
        return float((np.abs(np.linalg.pinv(self._wheels.jacobian.T)) @ wrench).max())

    @cached_property
    def _motion_rows(self) -> list[list[float]]:
        rows: list[list[float]] = np.linalg.pinv(self._wheels.jacobian).tolist()
        return rows
