"""Touch: whether something that is not on the map touches the robot, and how it may push it."""

from __future__ import annotations

import numpy as np

from stack.localisation.health import ScanEvaluator
from stack.localisation.mcl.confidence import MANY_LONG
from stack.types import FloatArray, Footprint, Pose2D, Scan

_LEAST_BEAMS = 2
"""Beams that end at what touches the robot; one alone may be noise."""

TOUCH_DISTANCE = 0.05
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
        self._starts = footprint.points
        self._edges = np.roll(footprint.points, -1, axis=0) - footprint.points
        self._squares = np.einsum("ij,ij->i", self._edges, self._edges)
        self._radius = footprint.circumscribed_radius
        self._evaluator = evaluator

    def touches(self, scan: Scan, pose: Pose2D, *, again: bool = False) -> bool:
        """Return whether a scan from a base pose in the map frame shows a touch.

        A first touch counts only at a pose that no beam contradicts: at a wrong pose, walls next to
        the robot seem to be unmapped things.

        Args:
            scan: of the lidar.
            pose: of the base at the scan.
            again: whether something touched the robot not long ago.
        """
        mount = scan.mount
        reach = self._radius + TOUCH_DISTANCE + float(np.hypot(mount.x, mount.y))
        beams = np.flatnonzero(scan.ranges < reach)
        if beams.size < _LEAST_BEAMS:
            return False
        ranges, angles = scan.ranges[beams].astype(np.float64), scan.angles[beams]
        ends = np.column_stack([ranges * np.cos(angles), ranges * np.sin(angles)])
        beams = beams[self._distances(mount.transform(ends)) < TOUCH_DISTANCE]
        if beams.size < _LEAST_BEAMS:
            return False
        kinds, _ = self._evaluator.classified(pose, scan, beams)
        if np.count_nonzero(kinds == self._short) < _LEAST_BEAMS:
            return False
        return again or self._evaluator.view(pose, scan).long < MANY_LONG

    def _distances(self, points: FloatArray) -> FloatArray:
        """Return the distances (m,) of points (m, 2) from the outline, base frame, metres."""
        offsets = points[:, None] - self._starts
        shares = np.clip(np.einsum("mij,ij->mi", offsets, self._edges) / self._squares, 0.0, 1.0)
        away = np.linalg.norm(offsets - shares[..., None] * self._edges, axis=2)
        nearest: FloatArray = away.min(axis=1)
        return nearest


def pushed(seconds: float, covariance: FloatArray | None) -> FloatArray:
    """Return the (3, 3) covariance of the motion of a touched robot.

    Args:
        seconds: of the motion.
        covariance: that odometry states of it; None without any.
    """
    pushes = np.diag((seconds * np.array([TOUCH_SPEED, TOUCH_SPEED, _TOUCHED_TURN])) ** 2)
    return pushes if covariance is None else pushes + covariance
