"""Lanes beside a path, on which a robot passes people without turning away from its way.

As in M. Werling et al., "Optimal trajectory generation for dynamic street scenarios in a Frenet
frame", ICRA 2010, candidates differ in their offset from the path and in their speed. Each is
followed by pure pursuit (R. C. Coulter, CMU-RI-TR-92-01, 1992).
"""

from __future__ import annotations

import numpy as np

from stack.control.evasion.motions import TURNING_SPEED
from stack.drivetrain.description import RobotDescription
from stack.types import FloatArray, Pose2D, Twist

LANE_SPACING = 0.1
"""Metres between the points of a way."""

LANE_LOOKAHEAD = 0.7
"""Distance to the point that is steered for, metres."""

LANE_OFFSETS = (0.0, 0.2, -0.2, 0.4, -0.4, 0.6, -0.6, 0.9, -0.9)
"""Offsets of the lanes to the left of the path, metres."""

SPEED_SHARES = (1.0, 0.6, 0.3)
"""Speeds on the lanes, as shares of the wanted one."""

SLOWEST_ON_PATH = 0.05
"""m/s of a wanted velocity below which the robot does not drive along its path."""

LEAST_SPEED = 0.3
"""Least forward speed in m/s of the lanes that are tried: who waits goes on at this speed."""

NO_WAY: FloatArray = np.zeros((1, 4))
NO_LANES: FloatArray = np.empty((0, 2))


class Lanes:
    """The lanes of a robot along the path that it follows.

    Args:
        robot: limits and kind of drive.

    Attributes:
        steering: as `stack.control.evasion.kernels.lane_twist` takes it.
    """

    def __init__(self, robot: RobotDescription) -> None:
        from stack.control.evasion import kernels

        self._kernels = kernels
        drive, limits = robot.drivetrain, robot.limits
        self._usable = not drive.can_move_sideways
        radius = drive.turning_radius
        self.steering = np.array([
            LANE_SPACING, LANE_LOOKAHEAD, min(limits.angular_speed, TURNING_SPEED),
            1.0 / radius if radius else 1e6, float(drive.turns_in_place),
        ])  # fmt: skip

    def way(self, path: FloatArray, pose: Pose2D, wanted: Twist, reach: float) -> FloatArray:
        """Return the way along which a velocity leads, base frame; `NO_WAY` if along none.

        Args:
            path: (k, 2) next points, map frame: ahead, or behind a robot that reverses.
            pose: of the robot.
            wanted: velocity, base frame.
            reach: metres of path that are used.
        """
        if not self._usable or len(path) < 2 or abs(wanted.linear) < SLOWEST_ON_PATH:
            return NO_WAY
        points = self._kernels.evenly_spaced(np.ascontiguousarray(path), reach, LANE_SPACING)
        if len(points) < 2:
            return NO_WAY
        found: FloatArray = self._kernels.way_beside(
            np.ascontiguousarray(pose.inverse().transform(points))
        )
        return found

    def beside(self, way: FloatArray, wanted: Twist) -> FloatArray:
        """Return (l, 2) speed and offset of the lanes to try; the first one is the wanted one."""
        if way is NO_WAY:
            return NO_LANES
        speed = max(wanted.linear, LEAST_SPEED) if wanted.linear > 0.0 else wanted.linear
        rows = [(share * speed, offset) for share in SPEED_SHARES for offset in LANE_OFFSETS]
        return np.array([(wanted.linear, 0.0), *rows[1:]])

    def twist(self, way: FloatArray, speed: float, offset: float) -> Twist:
        """Return the velocity that leads onto a lane."""
        linear, angular, _ = self._kernels.lane_twist(
            way, 0, np.zeros(3), speed, offset, self.steering
        )
        return Twist(linear, angular)
