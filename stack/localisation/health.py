"""Localisation health: fit of a scan to the map at a pose, calibrated for the map.

The fit is the share of beams that the map explains. Beams that an unmapped obstacle may have
shortened have half weight: a person in front of the robot shortens beams, but only a wrong pose
makes them pass through walls. The fit to expect at a true pose depends on the map. It is measured
with simulated scans at poses sampled all over the map, with random obstacles. The probability that
the pose is right follows from it and from other features (health_model.py).
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace
from math import hypot, pi, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stack.localisation.distance_field import SignedDistanceField
from stack.localisation.planar import as_row
from stack.types import FloatArray, Pose2D, Scan

SHORT_OBJECT = 1.0
"""Evidence against a hypothesis of an unmapped object 6 degrees wide (log-likelihood)."""
LONG_OBJECT = 2.0
"""Evidence against a hypothesis of a mapped object that is missing: rarer than an unmapped one."""

FIT_BEAMS = 90
"""Number of beams of a scan in its fit, evenly spread over all directions."""

VIEW_BEAMS = 120
"""Number of beams of a scan that are classified for health, hypotheses and navigation."""

MAP_VARIANCE = 0.08**2 - 0.01**2
"""m²; of a return about a mapped wall, besides the lidar's noise: cells of 5 cm, and what is drawn
straighter than it is. 8 cm with a noise of 1 cm."""

_WEIGHTS = np.array([0.0, 1.0, 0.5, 1.0, 0.5, 0.5, 0.25])
"""Weights of beams IGNORED, MATCHED, SHORT, LONG, MISSING, SILENT, BEYOND in the fit."""

HEALTH_WINDOW = 1.0
"""Seconds of scans whose median is the health: a person who passes hides the map for less."""

_SAMPLES = 200
_LEAST_EVIDENCE = 0.25


_OBJECT_ANGLE = np.radians(6.0)
"""Radians; angle of an object whose cost is SHORT_OBJECT or LONG_OBJECT."""

_WIDE_OBJECT = np.radians(30.0)
"""Radians; a person at 0.8 m. Wider objects are rare."""

_WIDEST = float(np.sqrt(_WIDE_OBJECT / _OBJECT_ANGLE))

_LEAST_RUN = 3
"""Adjacent beams that an object has at least. At edges of doors and furniture the cells of the map
move one or two beams, always in favour of the same one of two equal rooms."""

_GAP = 0.3
"""Metres between the ranges of adjacent beams that meet two objects."""


class ScanView(NamedTuple):
    """Comparison of one scan with the map at one pose.

    Attributes:
        fit: share of the beams that the map explains, in [0, 1].
        short: share of the beams that end at something unmapped.
        long: share of the beams that pass a mapped wall.
        cost: minus the log-likelihood of the unmapped and missing objects that explain the rest.
    """

    fit: float
    short: float
    long: float
    cost: float


class ScanEvaluator:
    """Comparison of scans with a map.

    A beam that ends `deviation` from a wall has 0.61 of the credit of one that ends on it.

    Args:
        field: the map.
        noise: standard deviation of a range of the lidar, metres.

    Attributes:
        deviation: of a return from a mapped wall, metres; that of coarse cells comes in addition.
    """

    def __init__(self, field: SignedDistanceField, noise: float) -> None:
        from stack.localisation import kernels

        self._kernels, self._field = kernels, field
        self.deviation = sqrt(noise**2 + MAP_VARIANCE)
        self._costs = np.zeros(7)
        self._costs[[kernels.SHORT, kernels.BEYOND]] = SHORT_OBJECT
        self._costs[[kernels.LONG, kernels.MISSING]] = LONG_OBJECT

    def fit(self, pose: Pose2D, scan: Scan) -> float:
        """Return the share of the beams in [0, 1] that the map explains with the base at `pose`."""
        return self.share(*self.classified(pose, scan, spread(scan.ranges.size, FIT_BEAMS)))

    def view(self, pose: Pose2D, scan: Scan) -> ScanView:
        """Return the comparison of a scan with the map at a pose of the base."""
        return self.compared(pose, scan)[0]

    def compared(self, pose: Pose2D, scan: Scan) -> tuple[ScanView, NDArray[np.int8], FloatArray]:
        """Return the comparison with a pose of the base, and class and credit of each beam."""
        beams = spread(scan.ranges.size, VIEW_BEAMS)
        kinds, credits = self.classified(pose, scan, beams)
        counts: list[int] = np.bincount(kinds, minlength=7).tolist()
        k = self._kernels
        known = max(1, counts[k.MATCHED] + counts[k.SHORT] + counts[k.LONG])
        view = ScanView(
            self.share(kinds, credits),
            counts[k.SHORT] / known,
            counts[k.LONG] / known,
            self._cost(kinds, scan, beams) + self._cost_of_place(pose),
        )
        return view, kinds, credits

    def _cost_of_place(self, pose: Pose2D) -> float:
        """Return the cost of a robot where the map has an object or ends."""
        cost = float(self._costs[self._kernels.LONG] * np.sqrt(pi / _OBJECT_ANGLE))
        return cost if self._field.is_blocked(pose) else 0.0

    def _cost(self, kinds: NDArray[np.int8], scan: Scan, beams: NDArray[np.int64]) -> float:
        """Return the cost of the runs of adjacent beams that the map does not explain.

        Adjacent beams of similar range meet the same object, so the cost of a run grows with the
        root of its angle, up to _WIDE_OBJECT; what is wider is as much worse as it is wider. Runs
        shorter than _LEAST_RUN are no objects.
        """
        step = abs(scan.angle_increment * scan.ranges.size / max(1, beams.size))
        costs: FloatArray = self._kernels.object_costs(
            kinds, scan.ranges[beams].astype(np.float64), self._costs, scan.range_max, _GAP,
            _LEAST_RUN, step / _OBJECT_ANGLE, _WIDEST,
        )  # fmt: skip
        return float(costs.sum())

    def share(self, kinds: NDArray[np.int8], credits: FloatArray) -> float:
        """Return the share in [0, 1] of classified beams that the map explains."""
        counts = np.bincount(kinds, minlength=7)
        total = float(_WEIGHTS @ counts)
        credit = float(credits.sum()) + 0.5 * float(counts[self._kernels.SILENT])
        # Where most of the map is unknown, a few matching beams must not give a good fit.
        return credit / max(total, _LEAST_EVIDENCE * kinds.size, 1.0)

    def classified(
        self, pose: Pose2D, scan: Scan, beams: NDArray[np.int64]
    ) -> tuple[NDArray[np.int8], FloatArray]:
        """Return the class and the credit of each beam; see `kernels.classify_beams`."""
        sensor = as_row(pose.compose(scan.mount))
        kinds, credits = self._kernels.classify_beams(
            self._field.occupancy, self._field.distances, self._field.placement, sensor,
            scan.angles[beams], scan.ranges[beams].astype(np.float64), scan.range_max,
            hypot(self.deviation, self._field.surface_deviation),
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
        low: 5th percentile.
        middle: median.
    """

    low: float
    middle: float

    def relative(self, fit: float) -> float:
        """Return a fit in units of this distribution: 0 at `low`, 1 at `middle`."""
        return (fit - self.low) / (self.middle - self.low)


def calibrate(  # noqa: PLR0913 - what is simulated
    evaluator: ScanEvaluator,
    field: SignedDistanceField,
    like: Scan,
    noise: float,
    most_obstacles: int,
    generator: np.random.Generator,
) -> FitScale:
    """Measure the fits at true poses with simulated scans all over the free space.

    Args:
        evaluator: of the same map.
        field: the map.
        like: a scan with the lidar's beams, limits and mount; its ranges are ignored.
        noise: standard deviation of a range, metres.
        most_obstacles: largest number of unmapped obstacles around the robot.
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
    deviation = float(np.hypot(noise, field.resolution / np.sqrt(12.0)))
    beams = spread(like.ranges.size, FIT_BEAMS)  # the fit uses no others
    thin = replace(like, stamp=0.0, ranges=like.ranges[beams], bearings=like.angles[beams])
    angles = thin.angles
    fits = []
    for (x, y), heading, shift in zip(chosen, headings, jitter, strict=True):
        pose = Pose2D(float(x), float(y), float(heading))
        ranges = kernels.cast_rays(
            field.occupancy, field.placement, as_row(pose.compose(like.mount)), angles,
            like.range_max,
        )  # fmt: skip
        ranges += field.surface_depth
        ranges += generator.normal(0.0, deviation, like.ranges.size)[beams]
        ranges = _blocked(ranges, angles, most_obstacles, generator)
        scan = thin.with_ranges(ranges.astype(np.float32))
        fits.append(evaluator.fit(pose.compose(Pose2D(*map(float, shift))), scan))
    low, middle = np.percentile(fits, [5.0, 50.0])
    return FitScale(float(min(max(low, 0.05), 0.9)), float(min(max(middle, low + 0.02, 0.1), 0.98)))


def _blocked(
    ranges: FloatArray, angles: FloatArray, most: int, generator: np.random.Generator
) -> FloatArray:
    """Return the ranges along beams shortened by up to `most` random round obstacles."""
    for _ in range(int(generator.integers(0, most + 1))):
        distance = generator.uniform(0.4, 2.5)
        radius = generator.uniform(0.15, 0.35)
        bearing = generator.uniform(angles[0], angles[0] + 2.0 * pi)
        off = np.abs((angles - bearing + pi) % (2.0 * pi) - pi)
        hidden = np.sin(np.minimum(off, pi / 2)) * distance < radius
        ranges = np.where(hidden, np.minimum(ranges, distance), ranges)
    return ranges


class RecentViews:
    """Medians of the scans' views over the last HEALTH_WINDOW."""

    def __init__(self) -> None:
        self._kept: deque[tuple[float, ScanView]] = deque()
        self._median: ScanView | None = None

    def add(self, stamp: float, view: ScanView) -> None:
        """Add a view and remove those older than the window."""
        self._median = None
        self._kept.append((stamp, view))
        while self._kept[0][0] <= stamp - HEALTH_WINDOW:
            self._kept.popleft()

    def clear(self) -> None:
        """Remove all views."""
        self._median = None
        self._kept.clear()

    @property
    def newest(self) -> ScanView | None:
        """The newest view; None without views."""
        return self._kept[-1][1] if self._kept else None

    @property
    def median(self) -> ScanView | None:
        """The (lower) median of each figure; None without views."""
        if self._median is None and self._kept:
            views = [view for _, view in self._kept]
            self._median = ScanView(*(
                sorted(figures)[(len(views) - 1) // 2] for figures in zip(*views, strict=True)
            ))  # fmt: skip
        return self._median
