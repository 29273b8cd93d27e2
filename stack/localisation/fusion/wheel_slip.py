"""Error of a displacement that wheels alone measure, by their slip."""

from __future__ import annotations

from math import hypot

import numpy as np

from stack.drivetrain.drivetrain import Drivetrain
from stack.types import FloatArray, Pose2D


class WheelSlip:
    """Covariance of a displacement measured by wheels that slip independently.

    A wheel that rolls r metres slips by a distance of the variance slip² r. The heading error is
    the larger, the narrower the track: slip sqrt(2) / track radians on the first metre of a
    differential robot.

    Args:
        drivetrain: of the robot.
        slip: standard deviation of the slip of a wheel on its first metre, metres.
    """

    def __init__(self, drivetrain: Drivetrain, slip: float) -> None:
        count = drivetrain.encoders
        moved = [drivetrain.from_wheels([0.0] * count, unit.tolist()) for unit in np.eye(count)]
        self._gains = slip * np.array([(pose.x, pose.y, pose.heading) for pose in moved]).T
        turns = np.array([abs(pose.heading) for pose in moved])
        self._levers = 1.0 / (count * turns)

    def covariance(self, moved: Pose2D) -> FloatArray:
        """Return the (3, 3) covariance of a displacement, in its frame: m, m, rad.

        Each wheel is taken to roll the whole distance, and the arc of the turn.
        """
        rolled = hypot(moved.x, moved.y) + abs(moved.heading) * self._levers
        total: FloatArray = (self._gains * rolled) @ self._gains.T
        return total
