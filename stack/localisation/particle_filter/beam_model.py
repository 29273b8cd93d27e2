"""Sensor model of the particles: which beams count, and their likelihood field.

Probabilistic Robotics, 2005, section 6.4, with beam skipping: a beam that ends at something
unmapped, or that passes where the map has a wall, says nothing of where within a place the robot
is. Which place it is in is the evidence of the hypotheses (`ScanView.cost`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stack.localisation.known_map import KnownMap
from stack.localisation.parameters import LocaliserParameters
from stack.localisation.search.matches import beam_points, returned_beams
from stack.types import FloatArray, Pose2D, Scan

HIT_SHARE = 0.9
"""Share of returns that the map explains; the others are people and moved things."""
TRUST = 0.3
"""Exponent of a scan's likelihood; below 1, since beams are not independent."""
LEAST_BEAMS = 0.25
"""Beams that the map does not explain at a settled pose do not weight the particles while at least
this share of the beams is left."""

_UNIT = 1000.0
"""Table entries of a log-likelihood of 1."""

_IN_WALL = 10.0
"""Beams outside the map whose likelihood a pose inside a wall has in addition."""


class BeamModel:
    """Log-likelihoods of scans at particles.

    Args:
        known_map: the map.
        parameters: number of beams.
    """

    def __init__(self, known_map: KnownMap, parameters: LocaliserParameters) -> None:
        from stack.localisation import kernels

        self._kernels, self._field, self._evaluator = kernels, known_map.field, known_map.evaluator
        self._parameters = parameters
        logs = self._field.log_likelihoods(self._evaluator.deviation, HIT_SHARE)
        self._least = float(logs.min())
        margin = round(self._least * _UNIT)
        table = np.rint(logs * _UNIT).astype(np.int16)
        self._table = np.pad(table, 1, constant_values=margin)

    def points(self, pose: Pose2D, scan: Scan, *, skip: bool) -> FloatArray:
        """Return (m, 2) end points, base frame, of the beams that weight the particles.

        Args:
            pose: of the base at the scan's stamp, map frame.
            scan: the scan.
            skip: leave out beams that the map does not explain at the pose.
        """
        beams = returned_beams(scan, self._parameters.beams)
        if skip and beams.size:
            explained = beams[self._explained(pose, scan, beams)]
            if explained.size >= max(10.0, LEAST_BEAMS * beams.size):
                beams = explained
        return beam_points(scan, beams)

    def log_likelihoods(self, poses: FloatArray, points: FloatArray) -> FloatArray:
        """Return (n,) log-likelihoods of points (m, 2), base frame, at poses (n, 3)."""
        scores, blocked = self._kernels.score_poses(
            self._table, self._field.occupancy, self._field.placement,
            np.ascontiguousarray(poses), np.ascontiguousarray(points.T, dtype=np.float32),
        )  # fmt: skip
        logs: FloatArray = scores.astype(np.float64)
        logs *= TRUST / _UNIT
        logs[blocked] += TRUST * _IN_WALL * self._least
        return logs

    def _explained(self, pose: Pose2D, scan: Scan, beams: NDArray[np.int64]) -> NDArray[np.bool_]:
        kinds, _ = self._evaluator.classified(pose, scan, beams)
        matched: NDArray[np.bool_] = kinds == self._kernels.MATCHED
        return matched
