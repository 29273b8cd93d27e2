"""Collision checks of the footprint swept along a motion."""

from __future__ import annotations

from functools import cache
from math import ceil, hypot
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stack.geometry.polygons import fill_polygon
from stack.types import LETHAL_COST, CostGrid, FloatArray, Footprint, Pose2D, Twist

SLACK = 0.003
"""Metres by which a point inside the padding may still come nearer."""

NOTHING_SEEN = np.empty((0, 2))

BoolArray = NDArray[np.bool_]


class SweptFootprint:
    """Checks motions of one robot against lethal cells and, if seen, scan points.

    Cells that the footprint covers already do not count, so that the robot can always leave them.

    Args:
        footprint: outline of the robot.
        padding: distance in metres that is kept to the points that are seen.
        exact: check only the centre of a lethal cell: the error is at most half a cell and zero on
            average. Otherwise the whole cell is an obstacle, which closes passages less than a cell
            wider than the robot. Use it together with `see`.
    """

    def __init__(self, footprint: Footprint, *, padding: float = 0.0, exact: bool = False) -> None:
        from stack.control import kernels
        from stack.safety.kernels import time_to_contact

        self._seen: FloatArray | None = None
        self._kernels: Any = kernels
        self._time_to_contact = time_to_contact
        self._footprint, self._padding, self._exact = footprint, padding, exact
        self._corners = np.ascontiguousarray(footprint.points, dtype=np.float64)
        self._radius = footprint.circumscribed_radius
        self.body, self._reach = cache(self._filled), cache(self._grown)
        self._near: tuple[CostGrid | None, NDArray[np.uint8]] = (None, np.empty((0, 0), np.uint8))

    def keep(self, padding: float) -> None:
        """Keep another distance to the points that are seen, metres."""
        self._padding = padding

    def see(self, points: FloatArray | None) -> None:
        """Check the points (m, 2) of the newest scan, map frame; None: check the costs only."""
        self._seen = points

    def arc(self, costs: CostGrid, pose: Pose2D, twist: Twist, horizon: float) -> tuple[float, int]:
        """Time for which a constant twist stays clear.

        Args:
            costs: costmap, map frame.
            pose: start pose, map frame.
            twist: to check.
            horizon: seconds to look ahead.

        Returns:
            Seconds (inf: clear over the whole horizon), and the highest passable cost under the
            base up to there.
        """
        speed = hypot(twist.linear, twist.lateral)
        step = costs.resolution / (speed + abs(twist.angular) * self._radius)
        free, cost = self._kernels.sweep(
            self._ground(costs), pose.x, pose.y, pose.heading,
            twist.linear, twist.lateral, twist.angular, horizon, step,
        )  # fmt: skip
        if self._seen is None:
            return free, cost
        time, _ = self._time_to_contact(
            pose.inverse().transform(self._seen), self._corners, self._radius, self._padding, SLACK,
            twist.linear, twist.lateral, twist.angular, min(free, horizon),
        )  # fmt: skip
        return min(free, float(time)), cost

    def free_times(
        self, costs: CostGrid, poses: FloatArray, twists: FloatArray, horizons: FloatArray
    ) -> FloatArray:
        """Times for which constant twists stay clear from several poses, as `arc`.

        Args:
            costs: costmap, map frame.
            poses: (k, 3) x, y, heading of the start, map frame.
            twists: (n, 3) m/s forward, m/s to the left, rad/s.
            horizons: (n,) seconds to look ahead.

        Returns:
            (k, n) seconds; inf: clear over the whole horizon.
        """
        free: FloatArray = self._kernels.free_times(
            self._ground(costs), np.ascontiguousarray(poses), twists, horizons,
            NOTHING_SEEN if self._seen is None else np.ascontiguousarray(self._seen),
            self._corners, self._radius, self._padding, SLACK,
        )  # fmt: skip
        return free

    def clear_poses(self, costs: CostGrid, pose: Pose2D, poses: FloatArray) -> NDArray[np.int64]:
        """Count the clear poses of each motion before its first collision.

        Args:
            costs: costmap, map frame.
            pose: current pose of the robot, map frame.
            poses: (n, k, 3) x, y, heading of k poses on each of n motions, map frame.

        Returns:
            (n,) in 0..k.
        """
        counts: NDArray[np.int64] = self._kernels.clear_poses(
            self._ground(costs), pose.x, pose.y, pose.heading, np.ascontiguousarray(poses),
            self._near_lethal(costs),
        )  # fmt: skip
        return counts

    def _near_lethal(self, costs: CostGrid) -> NDArray[np.uint8]:
        """(rows, columns): 0 where no lethal cell is within the footprint's radius.

        Computed once for each grid: it stays the same until a sensor changes the costmap.
        """
        import cv2

        if self._near[0] is costs:
            return self._near[1]
        cells = ceil(self._radius / costs.resolution) + 2
        disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * cells + 1, 2 * cells + 1))
        lethal = (costs.cells == LETHAL_COST).view(np.uint8)
        self._near = costs, np.asarray(cv2.dilate(lethal, disc), np.uint8)
        return self._near[1]

    def _ground(self, costs: CostGrid) -> Any:
        """Return costmap and footprint as the kernels take them."""
        side = costs.resolution
        return self._kernels.Ground(
            costs.cells, side, *costs.origin, self.body(side), self._reach(side)
        )

    def _grown(self, resolution: float) -> FloatArray:
        """(n, 2) corners of the polygon in which the centre of a lethal cell is a collision."""
        if self._exact:
            return self._corners
        # The whole cell counts: its centre lies within half a diagonal of the footprint.
        away = np.linalg.norm(self._corners, axis=1, keepdims=True)
        grown: FloatArray = self._corners * (1.0 + 2.0 * resolution / away)
        return grown

    def _filled(self, resolution: float) -> FloatArray:
        """(m, 2) points that fill the footprint, at most 0.7 cells apart, base frame."""
        return fill_polygon(self._footprint.points, 0.7 * resolution)
