"""Local map: several scans merged into surfels and a score field, to match another scan with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import cv2
import numpy as np

from stack.localisation.planar import as_pose, as_row, rotation
from stack.mapping.slam.matching import kernels
from stack.mapping.slam.matching.scans import PreparedScan
from stack.types import FloatArray, Pose2D

SURFEL_REACH, PAIR_REACH = 0.1, 0.15
"""Metres; largest distances of corresponding points, to the surroundings and of two scans."""
EDGE_OVERLAP = 0.4
"""Share of a scan's points that an edge explains."""

LEVELS, WIDE_LEVELS = 6, 8
"""Of the pyramid of scores: cells of up to 32 times the resolution, and for wide searches 128."""

BLUR = 2.0
"""Standard deviation of the score around a surfel, in cells."""

SEARCH_BEAMS, WIDE_BEAMS = 100, 200
"""Points that a search uses, at most, and a wide one."""

MOST_NODES = 20_000
"""Evaluations of a search, at most; one of all points costs about 0.1 µs a point."""

MARGIN = 1.0
"""Metres around the points."""

UNKNOWN_VARIANCE = 1.0
"""Square metres or radians: variance in a direction that no scan determines."""


@dataclass(frozen=True, slots=True)
class ScanMatch:
    """Result of matching a scan.

    Attributes:
        pose: of the base, in the frame of the reference.
        information: (3, 3) inverse covariance in the base frame: x, y, heading.
        overlap: share of the points with normals that correspond to a surface, in [0, 1].
    """

    pose: Pose2D
    information: FloatArray
    overlap: float

    @property
    def base_covariance(self) -> FloatArray:
        """(3, 3) covariance of x, y, heading, base frame."""
        known = self.information + np.eye(3) / UNKNOWN_VARIANCE
        covariance: FloatArray = np.linalg.inv(known).astype(np.float64)
        return covariance

    @property
    def covariance(self) -> FloatArray:
        """(3, 3) covariance of x, y, heading, frame of the reference."""
        local = self.base_covariance + np.diag([1e-5, 1e-5, 1e-6])
        turn = rotation(self.pose.heading)
        total: FloatArray = turn @ local @ turn.T
        return total


class LocalMap:
    """Surfels and scores of merged scans.

    Args:
        scans: with the pose of each, all in one frame.
        resolution: side of a cell, metres.
        wide: whether it is for searches of tens of metres, by many points.
    """

    def __init__(
        self,
        scans: Sequence[tuple[Pose2D, PreparedScan]],
        resolution: float,
        wide: bool = False,
    ) -> None:
        self._levels, self._beams = (WIDE_LEVELS, WIDE_BEAMS) if wide else (LEVELS, SEARCH_BEAMS)
        rows = [as_row(pose) for pose, _ in scans]
        parts = list(zip(rows, (scan for _, scan in scans), strict=True))
        points = np.concatenate([kernels.transform(r, s.points, False) for r, s in parts])
        normals = np.concatenate([kernels.transform(r, s.normals, True) for r, s in parts])
        low = points.min(axis=0, initial=np.inf) if points.size else np.zeros(2)
        high = points.max(axis=0, initial=-np.inf) if points.size else np.zeros(2)
        origin = np.floor((low - MARGIN) / resolution) * resolution
        columns, height = (
            int(n) for n in np.ceil((high + MARGIN - origin) / resolution).astype(int) + 1
        )
        self.placement = np.array([origin[0], origin[1], resolution])
        index, self.surfels = kernels.rasterise(points, normals, self.placement, height, columns)
        empty = (index < 0).astype(np.uint8)
        self._distances, nearest = cv2.distanceTransformWithLabels(
            empty, cv2.DIST_L2, cv2.DIST_MASK_5, labelType=cv2.DIST_LABEL_PIXEL
        )
        # OpenCV numbers the cells with points from 1 in an order of its own.
        seeds = index >= 0
        surfel_of = np.full(int(nearest.max(initial=0)) + 1, -1, np.int32)
        surfel_of[nearest[seeds]] = index[seeds]
        self.labels = np.ascontiguousarray(surfel_of[nearest])

    @cached_property
    def pyramid(self) -> Any:
        """(levels, rows, columns) uint8; see `kernels.search`."""
        scores = np.rint(255.0 * np.exp(-0.5 * (self._distances / BLUR) ** 2)).astype(np.uint8)
        levels = [scores]
        for level in range(self._levels - 1):
            step = 1 << level
            pooled = levels[-1].copy()
            pooled[:-step] = np.maximum(pooled[:-step], pooled[step:])
            pooled[:, :-step] = np.maximum(pooled[:, :-step], pooled[:, step:])
            levels.append(pooled)
        return np.ascontiguousarray(np.stack(levels))

    def search(
        self,
        scan: PreparedScan,
        centre: Pose2D,
        window: tuple[float, float],
        *,
        deviations: tuple[float, float] | None = None,
        least: float = 0.1,
    ) -> Pose2D | None:
        """Return the pose with the best score around `centre`; None below `least`.

        Args:
            scan: to match.
            centre: of the window.
            window: half width, metres and radians.
            deviations: of the centre, metres and radians: at one deviation a score loses 0.02.
            least: score.
        """
        points = scan.points
        if points.shape[0] == 0:
            return None
        if points.shape[0] > self._beams:
            chosen = np.linspace(0, points.shape[0] - 1, self._beams).astype(int)
            points = np.ascontiguousarray(points[chosen])
        farthest = float(np.percentile(np.hypot(points[:, 0], points[:, 1]), 90))
        angle_step = float(self.placement[2]) / max(1.0, farthest)
        lost = np.zeros(2)
        if deviations is not None:
            lost = 0.02 / np.square(np.maximum(deviations, 1e-3))
        row, score = kernels.search(
            self.pyramid, points, self.placement, as_row(centre), np.array(window), angle_step,
            lost, least, MOST_NODES,
        )  # fmt: skip
        return as_pose(row) if score >= 0.0 else None

    def align(
        self,
        scan: PreparedScan,
        start: Pose2D,
        prior: tuple[Pose2D, FloatArray] | None = None,
    ) -> ScanMatch:
        """Refine a pose near the right one.

        Args:
            scan: to match.
            start: in the frame of the reference.
            prior: pose by odometry and its (3, 3) information, frame of the reference.
        """
        expected, held = (start, np.zeros((3, 3))) if prior is None else prior
        if not self.surfels.size:
            return ScanMatch(start, np.zeros((3, 3)), 0.0)
        row, information, overlap = kernels.align_to_surfels(
            self.labels, self.surfels, self.placement, scan.points, scan.normals, as_row(start),
            as_row(expected), np.ascontiguousarray(held * scan.deviation**2), SURFEL_REACH,
            scan.deviation, 30,
        )  # fmt: skip
        return ScanMatch(as_pose(row), information, float(overlap))


def align_pair(fixed: PreparedScan, scan: PreparedScan, start: Pose2D) -> ScanMatch:
    """Align a scan to a single one; poses are in the base frame of the fixed scan."""
    if not (fixed.points.size and scan.points.size):
        return ScanMatch(start, np.zeros((3, 3)), 0.0)
    row, information, overlap = kernels.align_pair(
        fixed.points, fixed.normals, fixed.bearings, fixed.sensor, scan.points, scan.normals,
        as_row(start), PAIR_REACH, scan.deviation, 30,
    )  # fmt: skip
    return ScanMatch(as_pose(row), information, float(overlap))
