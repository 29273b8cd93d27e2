"""Comparison of the wheels with gyro and accelerometer: slip and pushes."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from itertools import islice
from math import hypot, sqrt

from stack.drivetrain.description import ImuDescription
from stack.types import Imu, Twist

DISTURBANCE_WINDOW = 0.2
"""Time over which wheels are compared with gyro and accelerometer, s: long enough to average the
noise of the samples, short enough that a push is noticed before the robot has moved a cell."""
SPEED_TOLERANCE = 0.25
"""The robot is disturbed if wheels and accelerometer disagree on the change of speed by more, m/s.
"""
TURN_TOLERANCE = 0.06
"""The robot is disturbed if wheels and gyro disagree on the rotation by more, rad."""
CERTAIN = 5.0
"""Deviations of the inertial sensor beyond which a difference is not its noise."""
TURN_TOLERANCE_SHARE = 0.25
"""Added to TURN_TOLERANCE per radian turned: wheels slide in turns."""


@dataclass(frozen=True, slots=True)
class Compared:
    """One step as wheels and inertial sensor measure it.

    Attributes:
        begin: seconds.
        end: seconds.
        turned: by the wheels, radians.
        rotated: by the gyro, bias removed, radians; None without one.
        gained: (x, y) change of velocity by the accelerometer, base frame, m/s; None without one.
        twist: velocity by the wheels at the end.
    """

    begin: float
    end: float
    turned: float
    rotated: float | None
    gained: tuple[float, float] | None
    twist: Twist


class InertialComparison:
    """Whether wheels and inertial sensor agree over the last DISTURBANCE_WINDOW.

    Args:
        imu: its noise and bias raise the tolerances where they are larger.
    """

    def __init__(self, imu: ImuDescription) -> None:
        noisy = sqrt(DISTURBANCE_WINDOW / imu.rate)
        speed = hypot(imu.accelerometer_bias * DISTURBANCE_WINDOW, imu.accelerometer_noise * noisy)
        self._speed_tolerance = max(SPEED_TOLERANCE, CERTAIN * speed)
        self._turn_tolerance = max(TURN_TOLERANCE, CERTAIN * imu.gyro_noise * noisy)
        self._steps: deque[Compared] = deque()

    def since(self, step: Compared) -> float | None:
        """Return the stamp since when wheels and inertial sensor disagree; None if they agree.

        In the base frame, the velocity changes by the specific force and by the rotation of the
        frame: Δv = ∫ (a - ω x v) dt. In this time the floor's
        inclination is far below the tolerance.

        Args:
            step: the newest one.
        """
        steps = self._steps
        steps.append(step)
        while len(steps) > 2 and steps[1].end < step.end - DISTURBANCE_WINDOW - 1e-9:
            steps.popleft()
        if len(steps) < 2:
            return None
        since, x, y = steps[1].begin, steps[0].twist.linear, steps[0].twist.lateral
        turned = rotated = swept = centripetal = 0.0
        measured = True
        for known in islice(steps, 1, None):
            turn = known.turned
            if known.rotated is not None:
                turned += known.turned
                turn = known.rotated
                rotated += turn
                swept += abs(turn)
            if known.gained is None:
                measured = False
                continue
            speed_x, speed_y = known.twist.linear, known.twist.lateral
            x += known.gained[0] + turn * speed_y
            y += known.gained[1] - turn * speed_x
            centripetal += abs(turn) * (abs(speed_x) + abs(speed_y))
        tolerance = self._turn_tolerance + TURN_TOLERANCE_SHARE * max(abs(turned), swept)
        if abs(turned - rotated) > tolerance:
            return since
        off = hypot(x - step.twist.linear, y - step.twist.lateral)
        if measured and off > self._speed_tolerance + TURN_TOLERANCE_SHARE * centripetal:
            return since
        return None


class VelocityGain:
    """Change of the base's velocity between two observations by the accelerometer."""

    def __init__(self) -> None:
        self._stamp = 0.0

    def between(self, imu: Imu | None, now: float) -> tuple[float, float] | None:
        """Return x and y of the integral of the specific force since the last call, m/s.

        A sample counts for the time since the one before; the newest is held until the
        observation's time. None without samples.
        """
        before, self._stamp = self._stamp, now
        if imu is None or imu.stamps.size == 0:
            return None
        gained_x, gained_y, force = 0.0, 0.0, (0.0, 0.0, 0.0)
        samples = zip(imu.stamps.tolist(), imu.linear_acceleration.tolist(), strict=True)
        for stamp, force in samples:
            seconds = max(min(stamp, now) - before, 0.0)
            gained_x += seconds * force[0]
            gained_y += seconds * force[1]
            before += seconds
        held = now - before
        return gained_x + held * force[0], gained_y + held * force[1]
