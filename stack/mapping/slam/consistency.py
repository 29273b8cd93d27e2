"""Consistency of a scan with the map that is being drawn: the health of SLAM.

Beams that end at known walls speak for the pose. Beams that pass known walls speak against it, and
so do, half as much, beams that end in space which was free: something new stands there, or the pose
is wrong. Beams that end in unknown space say nothing: the map grows there.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from stack.types import OccupancyGrid, Pose2D, Scan

BEAMS = 90
"""Beams that are compared."""

LEAST_EVIDENCE = 10
"""Beams in known space below which a scan says nothing."""

BEYOND = 0.25
"""Metres behind a wall from which on a beam has passed it."""

HEALTH_GAIN = 0.1
"""Share of a new scan in the health."""

LEAST_SHARE, FULL_SHARE = 0.2, 0.6
"""Share of the evidence of a scan that speaks for its pose, at health 0 and 1."""

_SHORT_WEIGHT = 0.5


class MapConsistency:
    """Comparison of scans with a map."""

    def __init__(self) -> None:
        self._occupancy: Any = np.zeros((0, 0), np.uint8)
        self._near: Any = np.zeros((0, 0), np.bool_)
        self._grid: OccupancyGrid | None = None

    def use(self, grid: OccupancyGrid) -> None:
        """Compare with a map from now on."""
        import cv2

        if grid is self._grid:
            return
        self._grid = grid
        self._occupancy = np.full(grid.cells.shape, 2, np.uint8)
        self._occupancy[grid.free], self._occupancy[grid.occupied] = 0, 1
        ring = np.ones((3, 3), np.uint8)
        self._near = cv2.dilate(grid.occupied.astype(np.uint8), ring) > 0

    def weighed(self, health: float, grid: OccupancyGrid, pose: Pose2D, scan: Scan) -> float:
        """Return the health after another scan; the same if it only shows what is not mapped."""
        self.use(grid)
        fit = self.fit(pose, scan)
        return health if fit is None else health + HEALTH_GAIN * (fit - health)

    def fit(self, pose: Pose2D, scan: Scan) -> float | None:
        """Return the health in [0, 1] of a pose by one scan; None where the scan says nothing."""
        share = self.share(pose, scan)
        if share is None:
            return None
        return min(1.0, max(0.0, (share - LEAST_SHARE) / (FULL_SHARE - LEAST_SHARE)))

    def share(self, pose: Pose2D, scan: Scan) -> float | None:
        """Return the share of the evidence in [0, 1] that speaks for a pose; None without any.

        Args:
            pose: of the base, map frame.
            scan: taken there.
        """
        from stack.localisation import kernels

        beams = np.flatnonzero(np.isfinite(scan.ranges))
        beams = beams[:: max(1, beams.size // BEAMS)]
        if self._grid is None or beams.size < LEAST_EVIDENCE or not self._occupancy.size:
            return None
        sensor = pose.compose(scan.mount)
        angles, ranges = scan.angles[beams], scan.ranges[beams].astype(np.float64)
        origin, resolution = self._grid.origin, self._grid.resolution
        walls = kernels.cast_rays(
            self._occupancy, (resolution, *origin),
            np.array([sensor.x, sensor.y, sensor.heading]), angles, float(scan.range_max),
        )  # fmt: skip
        x = sensor.x + ranges * np.cos(sensor.heading + angles)
        y = sensor.y + ranges * np.sin(sensor.heading + angles)
        rows = np.floor((y - origin[1]) / resolution).astype(np.int64)
        columns = np.floor((x - origin[0]) / resolution).astype(np.int64)
        height, width = self._occupancy.shape
        inside = (rows >= 0) & (rows < height) & (columns >= 0) & (columns < width)
        rows, columns = np.where(inside, rows, 0), np.where(inside, columns, 0)
        agree = inside & self._near[rows, columns]
        passed = ~agree & (ranges > walls + BEYOND)
        short = inside & ~agree & ~passed & (self._occupancy[rows, columns] == 0)
        fitting, wrong, new = (int(np.count_nonzero(kind)) for kind in (agree, passed, short))
        if fitting + wrong + new < LEAST_EVIDENCE:
            return None
        return fitting / (fitting + wrong + _SHORT_WEIGHT * new)
