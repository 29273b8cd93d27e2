"""Wheel odometry with the errors of real encoders and real wheels.

The robot's wheels roll without error in the physics unless they are made to slip; what a real
robot suffers on top (tyres of unequal size, slip, encoder steps) is put in here. Model after
J. Borenstein and L. Feng, "Measurement and Correction of Systematic Odometry Errors in Mobile
Robots", IEEE Trans. Robotics and Automation 12(6), 1996.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, floor, pi, sin, sqrt

from stack.drivetrain.description import OdometryNoise, RobotDescription
from stack.drivetrain.forward_kinematics import ForwardKinematics, forward_kinematics_of
from stack.streams import stream
from stack.types import STANDSTILL, Pose2D, Twist, wrap_angle
from stack.types import Odometry as OdometryReading

SPEED_WINDOW = 5
"""Readings over which the speed is taken: an encoder step over one alone would be coarse."""


@dataclass(frozen=True, slots=True)
class Encoders:
    """What the wheels' encoders show.

    Attributes:
        wheels: angle rolled by each driven wheel since the start, radians.
        steering: angles of the steered wheels, left and right, radians.
    """

    wheels: Sequence[float]
    steering: Sequence[float] = ()


class Odometry:
    """Integrates encoder readings to a pose in the odom frame.

    Each wheel has a scale error drawn once, and slip drawn at every reading with standard
    deviation slip x sqrt(metres rolled since the last one). How wheels move the base is a matter
    of the robot's kind (stack.drivetrain.forward_kinematics).
    """

    def __init__(self, robot: RobotDescription, seed: int) -> None:
        noise = robot.odometry
        self._slip, self._tick = noise.slip, 2.0 * pi / noise.ticks_per_turn
        self._random = stream(seed, "odometry")
        self._rolling: ForwardKinematics = forward_kinematics_of(robot)
        self._metres_per_tick = self._drawn_scales(noise, robot.wheels.radius)
        self._ticks: list[int] | None = None
        self._recent: deque[tuple[float, list[float]]] = deque(maxlen=SPEED_WINDOW)
        self.reading = OdometryReading(0.0, Pose2D(0.0, 0.0), STANDSTILL)

    def update(self, time: float, encoders: Encoders) -> None:
        """Take a reading of the encoders."""
        angles = self._rolling.wheel_angles(encoders.wheels)
        ticks = [floor(angle / self._tick) for angle in angles]
        # Always a draw a wheel, moving or not, so that the stream stays in step with time.
        draws: list[float] = self._random.standard_normal(len(ticks)).tolist()
        before, self._ticks = self._ticks, ticks
        if before is None:
            return
        self._rolling.steer([floor(a / self._tick) * self._tick for a in encoders.steering])
        rolled = [
            (now - then) * metres
            for now, then, metres in zip(ticks, before, self._metres_per_tick, strict=True)
        ]
        self._recent.append((time - self.reading.stamp, rolled))
        # Slip goes into the pose alone: an encoder does not feel it, so the speed is smooth.
        slips = [self._slip * sqrt(abs(r)) * draw for r, draw in zip(rolled, draws, strict=True)]
        pose = self._moved(self._rolling.moved(rolled, slips))
        self.reading = OdometryReading(time, pose, self._speed())

    def _drawn_scales(self, noise: OdometryNoise, radius: float) -> list[float]:
        """Metres that each wheel is taken to roll a tick."""
        scales = self._random.normal(1.0, noise.scale_error, self._rolling.count).tolist()
        return [scale * self._tick * radius for scale in scales]

    def _moved(self, step: Pose2D) -> Pose2D:
        """The pose after a small displacement, along its chord."""
        pose = self.reading.pose
        middle = pose.heading + step.heading / 2.0
        c, s = cos(middle), sin(middle)
        return Pose2D(
            pose.x + step.x * c - step.y * s,
            pose.y + step.x * s + step.y * c,
            wrap_angle(pose.heading + step.heading),
        )

    def _speed(self) -> Twist:
        seconds = sum(period for period, _ in self._recent)
        speeds = [
            sum(rolled[wheel] for _, rolled in self._recent) / seconds
            for wheel in range(self._rolling.count)
        ]
        velocity = self._rolling.moved(speeds, [0.0] * len(speeds))
        return Twist(velocity.x, velocity.heading, velocity.y)
