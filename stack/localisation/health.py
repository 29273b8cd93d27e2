"""Localisation health: fit of a scan to the map at a pose, calibrated for the map.

The fit is the share of beams that the map explains. Beams that an unmapped obstacle may have
shortened have half weight: a person in front of the robot shortens beams, but only a wrong pose
makes them pass through walls. The fit to expect at a true pose depends on the map. It is measured
with simulated scans at poses sampled all over the map, with random obstacles; the health is the fit
on the scale of that distribution.
"""

from __future__ import annotations

from bisect import insort
from collections import deque
from dataclasses import dataclass, replace
from math import pi

import numpy as np
from numpy.typing import NDArray

from stack.localisation.distance_field import SignedDistanceField, as_row
from stack.localisation.parameters import LocaliserParameters
from stack.types import LOST_HEALTH, TYPICAL_HEALTH, FloatArray, Pose2D, Scan

FIT_BEAMS = 90
"""Number of beams of a scan in its fit, evenly spread over all directions."""

FIT_DEVIATION = 0.08
"""Metres; a beam that ends this far from a wall has 0.61 of the credit of one that ends on it."""

_WEIGHTS = np.array([0.0, 1.0, 0.5, 1.0, 0.5, 0.5, 0.25])
"""Weights of beams IGNORED, MATCHED, SHORT, LONG, MISSING, SILENT, BEYOND in the fit."""

_SAMPLES = 200
_LEAST_EVIDENCE = 0.25


class ScanEvaluator:
    """Comparison of scans with a map."""

    def __init__(self, field: SignedDistanceField) -> None:
        from stack.localisation import kernels

        self._kernels, self._field = kernels, field

    def classify(self, pose: Pose2D, scan: Scan, beams: NDArray[np.int64]) -> NDArray[np.int8]:
        """Return the class of each beam with the base at `pose`; see `kernels.classify_beams`."""
        return self.classified(pose, scan, beams)[0]

    def fit(self, pose: Pose2D, scan: Scan) -> float:
        """Return the share of the beams in [0, 1] that the map explains with the base at `pose`."""
        return self.share(*self.classified(pose, scan, spread(scan.ranges.size, FIT_BEAMS)))

    def share(self, kinds: NDArray[np.int8], credits: FloatArray) -> float:
        """Return the share in [0, 1] of classified beams that the map explains."""
        weights = _WEIGHTS[kinds]
        total = float(weights.sum())
        credit = float(credits.sum()) + 0.5 * float((kinds == self._kernels.SILENT).sum())
        # Where most of the map is unknown, a few matching beams must not give a good fit.
        return credit / max(total, _LEAST_EVIDENCE * kinds.size, 1.0)

    def classified(
        self, pose: Pose2D, scan: Scan, beams: NDArray[np.int64]
    ) -> tuple[NDArray[np.int8], FloatArray]:
        """Return the class and the credit of each beam; see `kernels.classify_beams`."""
        sensor = as_row(pose.compose(scan.mount))
        kinds, credits = self._kernels.classify_beams(
            self._field.occupancy, self._field.distances, *self._field.placement, sensor,
            scan.angles[beams], scan.ranges[beams].astype(np.float64), scan.range_max,
            FIT_DEVIATION,
        )  # fmt: skip
        return kinds, credits


def spread(count: int, wanted: int) -> NDArray[np.int64]:
    """Return the indices of at most `wanted` of `count` beams, evenly spread."""
    if count <= wanted:
        return np.arange(count)
    return np.arange(wanted) * count // wanted


@dataclass(frozen=True, slots=True)
class FitScale:
    """Distribution of the fits at true poses of a map.

    Attributes:
        low: 5th percentile; LOST_HEALTH.
        middle: median; TYPICAL_HEALTH.
    """

    low: float
    middle: float

    def health(self, fit: float) -> float:
        """Return the health in [0, 1] of a fit."""
        scale = [0.0, LOST_HEALTH, TYPICAL_HEALTH, 1.0]
        return float(np.interp(fit, [0.0, self.low, self.middle, 1.0], scale))


def calibrate(
    evaluator: ScanEvaluator,
    field: SignedDistanceField,
    like: Scan,
    parameters: LocaliserParameters,
    generator: np.random.Generator,
) -> FitScale:
    """Measure the fits at true poses with simulated scans all over the free space.

    Args:
        evaluator: of the same map.
        field: the map.
        like: a scan with the lidar's beams, limits and mount; its ranges are ignored.
        parameters: noise of a range and number of unmapped obstacles.
        generator: for poses, noise and obstacles.
    """
    from stack.localisation import kernels

    cells = field.free_cells(0.25)
    if cells.shape[0] == 0:
        return FitScale(0.5, 0.9)
    chosen = field.centres(cells[generator.integers(0, cells.shape[0], _SAMPLES)])
    headings = generator.uniform(-pi, pi, _SAMPLES)
    jitter = generator.normal(0.0, [0.03, 0.03, 0.015], (_SAMPLES, 3))
    # Discretisation is noise as well: a surface is anywhere within its cell.
    deviation = float(np.hypot(parameters.range_noise, field.resolution / np.sqrt(12.0)))
    fits = []
    for (x, y), heading, shift in zip(chosen, headings, jitter, strict=True):
        pose = Pose2D(float(x), float(y), float(heading))
        ranges = kernels.cast_rays(
            field.occupancy, *field.placement, as_row(pose.compose(like.mount)), like.angles,
            like.range_max,
        )  # fmt: skip
        ranges += generator.normal(0.0, deviation, ranges.size)
        ranges = _blocked(ranges, like, parameters.health_obstacles, generator)
        scan = replace(like, stamp=0.0, ranges=ranges.astype(np.float32))
        fits.append(evaluator.fit(pose.compose(Pose2D(*map(float, shift))), scan))
    low, middle = np.percentile(fits, [5.0, 50.0])
    return FitScale(float(min(max(low, 0.05), 0.9)), float(min(max(middle, low + 0.02, 0.1), 0.98)))


def _blocked(
    ranges: FloatArray, like: Scan, most: int, generator: np.random.Generator
) -> FloatArray:
    """Return the ranges shortened by up to `most` random round obstacles such as people."""
    angles = like.angles
    for _ in range(int(generator.integers(0, most + 1))):
        distance = generator.uniform(0.4, 2.5)
        radius = generator.uniform(0.15, 0.35)
        bearing = generator.uniform(angles[0], angles[0] + 2.0 * pi)
        off = np.abs((angles - bearing + pi) % (2.0 * pi) - pi)
        hidden = np.sin(np.minimum(off, pi / 2)) * distance < radius
        ranges = np.where(hidden, np.minimum(ranges, distance), ranges)
    return ranges


class RecentMedian:
    """Median of a stamped value over a time window in seconds."""

    def __init__(self, window: float) -> None:
        self.window = window
        self._kept: deque[tuple[float, float]] = deque()

    def add(self, stamp: float, value: float) -> None:
        """Add a value and remove those older than the window."""
        self._kept.append((stamp, value))
        while self._kept[0][0] <= stamp - self.window:
            self._kept.popleft()

    def clear(self) -> None:
        """Remove all values."""
        self._kept.clear()

    @property
    def value(self) -> float | None:
        """The (lower) median; None without values."""
        ordered: list[float] = []
        for _, value in self._kept:
            insort(ordered, value)
        return ordered[(len(ordered) - 1) // 2] if ordered else None
