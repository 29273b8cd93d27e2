"""Odometry from the encoders of real wheels."""

from __future__ import annotations

from collections.abc import Sequence

from stack.drivetrain.drivetrain import Drivetrain
from stack.drivetrain.kinematics import moved
from stack.types import STANDSTILL, Odometry, Pose2D, Twist


class EncoderOdometry:
    """Integrates the angles of the wheels to a pose in the odom frame.

    Between two readings the base moves on an arc (`Drivetrain.from_wheels`).

    Args:
        drivetrain: kinematics, with the calibrated radii.

    Attributes:
        reading: after the last update.
    """

    def __init__(self, drivetrain: Drivetrain) -> None:
        self._drivetrain = drivetrain
        self._angles: Sequence[float] | None = None
        self.reading = Odometry(0.0, Pose2D(0.0, 0.0), STANDSTILL)

    def update(
        self, stamp: float, angles: Sequence[float], speeds: Sequence[float],
        steering: Sequence[float] = (),
    ) -> None:  # fmt: skip
        """Add one reading; the first one is the origin.

        Args:
            stamp: seconds on the body's clock.
            angles: of the driven wheels, radians; they count on beyond a full turn.
            speeds: of the driven wheels, rad/s.
            steering: angles of the steered wheels, left and right, radians.
        """
        drive = self._drivetrain
        before, self._angles = self._angles, drive.encoder_angles(angles)
        rolled = [0.0] * len(self._angles)
        if before is not None:
            turned = zip(drive.radii, before, self._angles, strict=True)
            rolled = [radius * (b - a) for radius, a, b in turned]
        none = [0.0] * len(rolled)
        step = drive.from_wheels(rolled, none, steering)
        encoder_speeds = drive.encoder_angles(speeds)
        rims = [radius * speed for radius, speed in zip(drive.radii, encoder_speeds, strict=True)]
        velocity = drive.from_wheels(rims, none, steering)
        pose = self.reading.pose.compose(moved(Twist(step.x, step.heading, step.y), 1.0))
        self.reading = Odometry(stamp, pose, Twist(velocity.x, velocity.heading, velocity.y))
