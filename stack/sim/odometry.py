"""Wheel odometry with the errors of real encoders and real wheels.

The robot's wheels roll without error in the physics unless they are made to slip; what a real
robot suffers on top (tyres of unequal size, slip, encoder steps) is put in here. Model after
J. Borenstein and L. Feng, "Measurement and Correction of Systematic Odometry Errors in Mobile
Robots", IEEE Trans. Robotics and Automation 12(6), 1996.
"""

from __future__ import annotations

from collections import deque
from math import cos, floor, pi, sin, sqrt

from stack.description import OdometryNoise, Wheels
from stack.streams import stream
from stack.types import STANDSTILL, Pose2D, Twist, wrap_angle
from stack.types import Odometry as OdometryReading

SPEED_WINDOW = 5
"""Readings over which the speed is taken: an encoder step over one alone would be coarse."""


class Odometry:
    """Integrates encoder readings (left and right wheel angle) to a pose in the odom frame.

    Each wheel has a scale error drawn once, and slip drawn at every reading with standard
    deviation slip x sqrt(metres rolled since the last one).
    """

    def __init__(self, wheels: Wheels, noise: OdometryNoise, seed: int) -> None:
        self._wheels, self._slip = wheels, noise.slip
        self._tick = 2.0 * pi / noise.ticks_per_turn
        self._random = stream(seed, "odometry")
        left, right = self._random.normal(1.0, noise.scale_error, 2).tolist()
        self._metres_per_tick = (
            left * self._tick * wheels.radius, right * self._tick * wheels.radius,
        )  # fmt: skip
        self._ticks: tuple[int, int] | None = None
        self._recent: deque[tuple[float, float, float]] = deque(maxlen=SPEED_WINDOW)
        self.reading = OdometryReading(0.0, Pose2D(0.0, 0.0), STANDSTILL)

    def update(self, time: float, angles: tuple[float, float]) -> None:
        """Take an encoder reading: the wheels' angles in radians."""
        ticks = floor(angles[0] / self._tick), floor(angles[1] / self._tick)
        # Always two draws, moving or not, so that the stream stays in step with time.
        draws: list[float] = self._random.standard_normal(2).tolist()
        before, self._ticks = self._ticks, ticks
        if before is None:
            return
        left = (ticks[0] - before[0]) * self._metres_per_tick[0]
        right = (ticks[1] - before[1]) * self._metres_per_tick[1]
        self._recent.append((time - self.reading.stamp, left, right))
        # Slip goes into the pose alone: an encoder does not feel it, so the speed is smooth.
        pose = self._moved(self._slipped(left, draws[0]), self._slipped(right, draws[1]))
        self.reading = OdometryReading(time, pose, self._speed())

    def _slipped(self, rolled: float, draw: float) -> float:
        return rolled + self._slip * sqrt(abs(rolled)) * draw

    def _moved(self, left: float, right: float) -> Pose2D:
        pose = self.reading.pose
        forward, turn = (left + right) / 2.0, (right - left) / self._wheels.separation
        middle = pose.heading + turn / 2.0
        return Pose2D(
            pose.x + forward * cos(middle),
            pose.y + forward * sin(middle),
            wrap_angle(pose.heading + turn),
        )

    def _speed(self) -> Twist:
        seconds = sum(entry[0] for entry in self._recent)
        left = sum(entry[1] for entry in self._recent) / seconds
        right = sum(entry[2] for entry in self._recent) / seconds
        return Twist((left + right) / 2.0, (right - left) / self._wheels.separation)
