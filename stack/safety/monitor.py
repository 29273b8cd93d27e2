"""Collision monitor: checks a twist against the points of the newest scan."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

import numpy as np

from stack.drivetrain.description import RobotDescription
from stack.drivetrain.kinematics import moved
from stack.types import FloatArray, Scan, Twist

NO_POINTS: FloatArray = np.empty((0, 2))


NEIGHBOURS, SAME_SURFACE = 3, 0.05
"""Number of beams to either side, and largest distance in metres, of points that are averaged."""

MOST_SHIFT = 0.008
"""Metres by which averaging may move a point: about the noise of a lidar, and less than the
padding. Without this limit the corner of a box would be seen up to 2 cm inside the box.
"""


@dataclass(frozen=True, slots=True)
class Contact:
    """First contact of a twist with a scan point.

    Attributes:
        time: seconds at this twist until the first point is within the padding; inf: none.
        x: current position of that point, base frame, metres.
        y: current position of that point, base frame, metres.
    """

    time: float
    x: float = 0.0
    y: float = 0.0


NOTHING_NEAR = Contact(inf)


class CollisionMonitor:
    """Sweeps the footprint along a twist against scan points, without a costmap."""

    SLACK = 0.005

    def __init__(self, robot: RobotDescription) -> None:
        from stack.safety import kernels

        self._kernels = kernels
        self._corners = np.ascontiguousarray(robot.footprint.points, dtype=np.float64)
        self._radius = robot.footprint.circumscribed_radius
        self._scan: Scan | None = None
        self._points = NO_POINTS

    def contact(self, twist: Twist, points: FloatArray, horizon: float, padding: float) -> Contact:
        """Return the first contact of a twist.

        Args:
            twist: to check.
            points: (m, 2) obstacle points, base frame, metres.
            horizon: seconds to look ahead.
            padding: distance kept free around the footprint, metres.
        """
        time, which = self._kernels.time_to_contact(
            points, self._corners, self._radius, padding, self.SLACK,
            twist.linear, twist.lateral, twist.angular, horizon,
        )  # fmt: skip
        return Contact(time, *points[which]) if which >= 0 else NOTHING_NEAR

    def points(self, scan: Scan, time: float, measured: Twist) -> FloatArray:
        """Return the (m, 2) end points of a scan in the current base frame, metres.

        The motion since the scan is compensated with the measured twist.

        Args:
            scan: to convert.
            time: now, seconds.
            measured: current velocity, base frame.
        """
        if scan is not self._scan:
            self._scan, self._points = scan, steadied(scan.points())
        age = max(0.0, time - scan.stamp)
        return moved(measured, age).inverse().transform(self._points)


def steadied(points: FloatArray) -> FloatArray:
    """Reduce the noise of points (n, 2), metres, in the order of their beams.

    A sigma filter (J.-S. Lee, "Digital image smoothing and the sigma filter", Computer Vision,
    Graphics, and Image Processing 24(2), 1983): each point becomes the mean of the points up to
    NEIGHBOURS beams away and within SAME_SURFACE of it. It adds no error on a flat wall, keeps the
    points of objects hit by a single beam, and moves no point farther than MOST_SHIFT.
    """
    total, count = points.copy(), np.ones(len(points))
    for shift in range(1, min(NEIGHBOURS, len(points) - 1) + 1):
        apart = points[shift:] - points[:-shift]
        same = np.einsum("ij,ij->i", apart, apart) < SAME_SURFACE**2
        total[shift:][same] += points[:-shift][same]
        total[:-shift][same] += points[shift:][same]
        count[shift:] += same
        count[:-shift] += same
    shifts = total / count[:, None] - points
    lengths = np.maximum(np.hypot(*shifts.T), MOST_SHIFT)
    steady: FloatArray = points + shifts * (MOST_SHIFT / lengths)[:, None]
    return steady
