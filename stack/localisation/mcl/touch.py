"""Touch: whether something that is not on the map touches the robot, and how it may push it."""

from __future__ import annotations

import numpy as np

from stack.geometry.polygons import distances_to_edges
from stack.localisation.health import ScanEvaluator
from stack.localisation.mcl.confidence import MANY_LONG
from stack.localisation.search.matches import beam_points
from stack.types import FloatArray, Footprint, Pose2D, Scan

_LEAST_BEAMS = 2
"""Beams that end at what touches the robot; one alone may be noise."""

TOUCHING = 0.05
"""Metres from the outline within which a return is a touch."""

TOUCH_SPEED = 0.15
"""Standard deviation of the speed at which what touches the robot may push it; the particles then
spread also while its wheels stand, m/s."""

_TOUCHED_TURN = 0.1
"""Standard deviation of the turning speed of a touched robot besides odometry, rad/s."""


class TouchSense:
    """Finds scans in which something unmapped is within a few centimetres of the footprint.

    A person who bumps into the robot moves it, and wheels alone do not notice that. A robot that is
    put elsewhere looks the same to them. But who pushes it touches it.

    Args:
        footprint: outline of the body, base frame.
        evaluator: of the map.
    """

    def __init__(self, footprint: Footprint, evaluator: ScanEvaluator) -> None:
        from stack.localisation.kernels import SHORT  # imports numba

        self._short = SHORT
        self._footprint, self._evaluator = footprint, evaluator

    def touches(self, scan: Scan, pose: Pose2D, *, again: bool = False) -> bool:
        """Return whether a scan from a base pose in the map frame shows a touch.

        A first touch counts only at a pose that no beam contradicts: at a wrong pose, walls next to
        the robot seem to be unmapped things.

        Args:
            scan: of the lidar.
            pose: of the base at the scan.
            again: whether something touched the robot not long ago.
        """
        reach = (
            self._footprint.circumscribed_radius
            + TOUCHING
            + float(np.hypot(scan.mount.x, scan.mount.y))
        )
        beams = np.flatnonzero(scan.ranges < reach)
        if beams.size < _LEAST_BEAMS:
            return False
        away = distances_to_edges(beam_points(scan, beams), self._footprint.points)
        beams = beams[away < TOUCHING]
        if beams.size < _LEAST_BEAMS:
            return False
        kinds, _ = self._evaluator.classified(pose, scan, beams)
        if np.count_nonzero(kinds == self._short) < _LEAST_BEAMS:
            return False
        return again or self._evaluator.view(pose, scan).long < MANY_LONG


def pushed(seconds: float, covariance: FloatArray | None) -> FloatArray:
    """Return the (3, 3) covariance of the motion of a touched robot.

    Args:
        seconds: of the motion.
        covariance: that odometry states of it; None without any.
    """
    pushes = np.diag((seconds * np.array([TOUCH_SPEED, TOUCH_SPEED, _TOUCHED_TURN])) ** 2)
    return pushes if covariance is None else pushes + covariance
