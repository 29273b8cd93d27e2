"""The footprint swept along a motion: how far it is clear on a costmap."""

from __future__ import annotations

from math import ceil, hypot

import numpy as np
from numpy.typing import NDArray

from stack.geometry.polygons import fill_polygon
from stack.types import LETHAL_COST, CostGrid, FloatArray, Footprint, Pose2D, Twist

SLACK = 0.003
"""Metres that something nearer than the padding may still come nearer."""

BoolArray = NDArray[np.bool_]


class SweptFootprint:
    """Checks motions of one robot against lethal cells and, where it has seen any, scan points.

    Cells that the footprint covers already do not count, so that a robot can always leave.

    Args:
        footprint: its outline.
        padding: metres that `arc` keeps free of the points of `seen`.
        exact: a lethal cell is an obstacle at its middle only, half a cell off at most and right on
            the average; else all of it is one, which shuts passages that are a cell wider than the
            robot. For those who know the points, too.

    Attributes:
        padding: metres, in force.
        seen: (m, 2) what the newest scan met, map frame; None: only the costs are looked at.
    """

    def __init__(self, footprint: Footprint, *, padding: float = 0.0, exact: bool = False) -> None:
        from stack.control import kernels
        from stack.safety.kernels import time_to_contact

        self.seen: FloatArray | None = None
        self._kernels, self._time_to_contact = kernels, time_to_contact
        self._footprint, self.padding, self._exact = footprint, padding, exact
        self._corners = np.ascontiguousarray(footprint.points, dtype=np.float64)
        self._radius = footprint.circumscribed_radius
        self._body: tuple[float, FloatArray] = (0.0, np.empty((0, 2)))

    def arc(self, costs: CostGrid, pose: Pose2D, twist: Twist, horizon: float) -> tuple[float, int]:
        """Seconds for which a constant twist stays clear.

        Args:
            costs: map frame.
            pose: to begin at, map frame.
            twist: to be driven.
            horizon: seconds to look ahead.

        Returns:
            Seconds (inf: clear over the whole horizon), and the worst passable cost on the way.
        """
        speed = hypot(twist.linear, twist.lateral)
        step = costs.resolution / (speed + abs(twist.angular) * self._radius)
        free, cost = self._kernels.sweep(
            costs.cells, costs.resolution, *costs.origin, self.body(costs.resolution),
            self._reach(costs.resolution), pose.x, pose.y, pose.heading,
            twist.linear, twist.lateral, twist.angular, horizon, step,
        )  # fmt: skip
        if self.seen is None:
            return free, cost
        time, _ = self._time_to_contact(
            pose.inverse().transform(self.seen), self._corners, self._radius, self.padding, SLACK,
            twist.linear, twist.lateral, twist.angular, min(free, horizon),
        )  # fmt: skip
        return min(free, float(time)), cost

    def clear_poses(self, costs: CostGrid, pose: Pose2D, poses: FloatArray) -> NDArray[np.int64]:
        """How many poses of each motion are clear before its first collision.

        Args:
            costs: map frame.
            pose: where the robot is now, map frame.
            poses: (n, k, 3) x, y, heading of k poses on each of n motions, map frame.

        Returns:
            (n,) in 0..k.
        """
        counts: NDArray[np.int64] = self._kernels.clear_poses(
            costs.cells, costs.resolution, *costs.origin, self.body(costs.resolution),
            self._reach(costs.resolution), pose.x, pose.y, pose.heading,
            np.ascontiguousarray(poses), self._near(costs),
        )  # fmt: skip
        return counts

    def _near(self, costs: CostGrid) -> NDArray[np.uint8]:
        """(rows, columns) 0 where nothing lethal is within reach of the footprint."""
        import cv2

        cells = ceil(self._radius / costs.resolution) + 2
        disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * cells + 1, 2 * cells + 1))
        lethal = (costs.cells == LETHAL_COST).view(np.uint8)
        return np.asarray(cv2.dilate(lethal, disc), np.uint8)

    def _reach(self, resolution: float) -> FloatArray:
        """(n, 2) corners of the polygon in which the middle of a lethal cell is a collision."""
        if self._exact:
            return self._corners
        # All of a cell counts: its middle lies within half a diagonal of the footprint.
        away = np.linalg.norm(self._corners, axis=1, keepdims=True)
        grown: FloatArray = self._corners * (1.0 + 2.0 * resolution / away)
        return grown

    def body(self, resolution: float) -> FloatArray:
        """(m, 2) points that fill the footprint, fit for cells of this size; base frame."""
        if self._body[0] != resolution:
            self._body = (resolution, fill_polygon(self._footprint.points, 0.7 * resolution))
        return self._body[1]
