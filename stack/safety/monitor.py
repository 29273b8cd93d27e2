"""Collision monitor: what the newest scan says about where a twist would lead."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

import numpy as np

from stack.drivetrain.description import RobotDescription
from stack.drivetrain.kinematics import moved
from stack.types import FloatArray, Scan, Twist

NO_POINTS: FloatArray = np.empty((0, 2))


NEIGHBOURS, SAME_SURFACE = 3, 0.05
"""Beams to either side, and metres between points that may be taken together."""

MOST_SHIFT = 0.008
"""Metres that taking points together may move one: about a lidar's noise, and less than is kept
free, as the corner of a box would else be seen up to 2 cm inside the box.
"""


@dataclass(frozen=True, slots=True)
class Contact:
    """What a twist would run into.

    Attributes:
        time: seconds at that twist until the first point is within the padding; inf: none.
        x: of that point now, base frame, metres.
        y: likewise.
    """

    time: float
    x: float = 0.0
    y: float = 0.0


NOTHING_NEAR = Contact(inf)


class CollisionMonitor:
    """Projects the footprint along a twist against scan points; no costmap in between."""

    SLACK = 0.005

    def __init__(self, robot: RobotDescription) -> None:
        from stack.safety import kernels

        self._kernels = kernels
        self._corners = np.ascontiguousarray(robot.footprint.points, dtype=np.float64)
        self._radius = robot.footprint.circumscribed_radius
        self._scan: Scan | None = None
        self._points = NO_POINTS

    def contact(self, twist: Twist, points: FloatArray, horizon: float, padding: float) -> Contact:
        """The first contact of a twist driven from here on.

        Args:
            twist: to be driven.
            points: (m, 2) what stands around, base frame, metres.
            horizon: seconds to look ahead.
            padding: metres to keep free round the footprint.
        """
        time, which = self._kernels.time_to_contact(
            points, self._corners, self._radius, padding, self.SLACK,
            twist.linear, twist.lateral, twist.angular, horizon,
        )  # fmt: skip
        return Contact(time, *points[which]) if which >= 0 else NOTHING_NEAR

    def points(self, scan: Scan, time: float, measured: Twist) -> FloatArray:
        """(m, 2) end points of a scan in the base frame of now, metres.

        The robot has moved on since the scan; at the measured twist, by a known bit.
        """
        if scan is not self._scan:
            self._scan, self._points = scan, steadied(scan.points())
        age = max(0.0, time - scan.stamp)
        return moved(measured, age).inverse().transform(self._points)


def steadied(points: FloatArray) -> FloatArray:
    """Points (n, 2) in the order of their beams with less noise.

    A sigma filter (J.-S. Lee, "Digital image smoothing and the sigma filter", Computer Vision,
    Graphics, and Image Processing 24(2), 1983): each becomes the mean of those up to NEIGHBOURS
    beams away that lie within SAME_SURFACE of it. On a flat wall that is exact; what a single beam
    sees stays as it is, and nothing moves farther than MOST_SHIFT.
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
