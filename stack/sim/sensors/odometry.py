"""Wheel odometry with the errors of real encoders and wheels.

In the physics the wheels roll almost without error. This module adds the errors of a real robot:
unequal wheel diameters, slip and encoder resolution. Model after J. Borenstein and L. Feng,
"Measurement and Correction of Systematic Odometry Errors in Mobile Robots", IEEE Trans. Robotics
and Automation 12(6), 1996.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from math import cos, floor, pi, sin, sqrt

from stack.drivetrain.description import OdometryNoise, RobotDescription
from stack.streams import stream
from stack.types import STANDSTILL, Pose2D, Twist, wrap_angle
from stack.types import Odometry as OdometryReading

SPEED_WINDOW = 5
"""Readings over which the speed is averaged; a single reading is too coarse (encoder steps)."""


class Odometry:
    """Integrates encoder readings to a pose in the odom frame.

    Each wheel has a constant scale error, drawn once, and slip, drawn at every reading with
    standard deviation slip x sqrt(metres rolled since the last reading). The motion of the base
    comes from the forward kinematics of the drive (`Drivetrain.from_wheels`).
    """

    def __init__(self, robot: RobotDescription, seed: int) -> None:
        noise = robot.odometry
        self._slip, self._tick = noise.slip, 2.0 * pi / noise.ticks_per_turn
        self._random = stream(seed, "odometry")
        self._drivetrain = robot.drivetrain
        self._steering: list[float] = []
        self._metres_per_tick = self._drawn_scales(noise, robot.drivetrain.radii)
        self._ticks: list[int] | None = None
        self._recent: deque[tuple[float, list[float]]] = deque(maxlen=SPEED_WINDOW)
        self._stamp, self._pose = 0.0, Pose2D(0.0, 0.0)

    @property
    def reading(self) -> OdometryReading:
        """The pose after the last update, and the mean velocity of the last SPEED_WINDOW."""
        return OdometryReading(self._stamp, self._pose, self._speed())

    def update(self, time: float, wheels: Sequence[float], steering: Sequence[float] = ()) -> None:
        """Add one reading of the encoders.

        Args:
            time: seconds.
            wheels: angle rolled by each driven wheel since the start, radians.
            steering: angles of the steered wheels, left and right, radians.
        """
        tick = self._tick
        ticks = [floor(angle / tick) for angle in self._drivetrain.encoder_angles(wheels)]
        # One draw per wheel even at standstill: the random stream depends on time alone.
        draws = self._random.standard_normal(len(ticks)).tolist()
        before, self._ticks = self._ticks, ticks
        if before is None:
            return
        self._steering = [floor(angle / tick) * tick for angle in steering]
        rolled = [
            (now - then) * metres
            for now, then, metres in zip(ticks, before, self._metres_per_tick, strict=True)
        ]
        self._recent.append((time - self._stamp, rolled))
        # Slip affects only the pose: encoders do not measure it, so the speed stays smooth.
        slips = [self._slip * sqrt(abs(r)) * draw for r, draw in zip(rolled, draws, strict=True)]
        step = self._drivetrain.from_wheels(rolled, slips, self._steering)
        self._stamp, self._pose = time, self._moved_by(step)

    def _drawn_scales(self, noise: OdometryNoise, radii: Sequence[float]) -> list[float]:
        """Draw the distance per encoder tick that odometry assumes for each wheel, metres."""
        scales = self._random.normal(1.0, noise.scale_error, self._drivetrain.encoders).tolist()
        return [scale * self._tick * radius for scale, radius in zip(scales, radii, strict=True)]

    def _moved_by(self, step: Pose2D) -> Pose2D:
        """Return the pose after a small displacement, taken along its chord."""
        pose = self._pose
        middle = pose.heading + step.heading / 2.0
        c, s = cos(middle), sin(middle)
        return Pose2D(
            pose.x + step.x * c - step.y * s,
            pose.y + step.x * s + step.y * c,
            wrap_angle(pose.heading + step.heading),
        )

    def _speed(self) -> Twist:
        if not self._recent:
            return STANDSTILL
        seconds = sum(period for period, _ in self._recent)
        speeds = [
            sum(rolled[wheel] for _, rolled in self._recent) / seconds
            for wheel in range(self._drivetrain.encoders)
        ]
        velocity = self._drivetrain.from_wheels(speeds, [0.0] * len(speeds), self._steering)
        return Twist(velocity.x, velocity.heading, velocity.y)
