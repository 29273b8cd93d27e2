"""How much of a doorway is free, by a scan."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray

from stack.types import FloatArray, Pose2D, Scan

LEAST_BEAMS = 5
"""Beams through a doorway from which its state can be told."""

LONGEST_UNSEEN = 0.15
"""Metres along a doorway without a beam."""

OBLIQUE = 0.35
"""Sine of the angle between a beam and the doorway below which it tells nothing."""


@dataclass(frozen=True, slots=True)
class Doorway:
    """A way between two jambs.

    Attributes:
        middle: map frame; the heading leads through it, to either side.
        width: between the jambs, metres.
    """

    middle: Pose2D
    width: float

    def free_width(self, scan: Scan, pose: Pose2D, beyond: float) -> float | None:
        """Return the widest part of the doorway that beams pass, metres; None if it is not seen.

        A beam passes the doorway if it ends farther behind it than `beyond`, or not at all.

        Args:
            scan: of a lidar.
            pose: of the base at the scan's stamp, map frame.
            beyond: metres behind the doorway that must be free too.
        """
        sensor = pose.compose(scan.mount)
        away = sensor.relative_to(self.middle)  # x: through the doorway, y: along it
        angles = scan.angles + away.heading
        forward = np.cos(angles) * (-1.0 if away.x > 0.0 else 1.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            distance = abs(away.x) / forward
            along = away.y + distance * np.sin(angles)
        seen = (forward > OBLIQUE) & (np.abs(along) <= 0.5 * self.width) & ~np.isnan(scan.ranges)
        seen &= distance + beyond < scan.range_max
        if np.count_nonzero(seen) < LEAST_BEAMS:
            return None
        order = np.argsort(along[seen])
        passed = (scan.ranges[seen] > distance[seen] + beyond)[order]
        return self._widest(along[seen][order], passed)

    def _widest(self, along: FloatArray, passed: NDArray[np.bool_]) -> float:
        """Return the width of the longest run of beams that pass, within the jambs.

        Each beam stands for half the distance to its neighbours. Where they are farther apart than
        LONGEST_UNSEEN, nothing is known.
        """
        half, beside = 0.5 * self.width, 0.5 * float(np.median(np.diff(along)))
        widest, begin, last = 0.0, inf, -inf
        for at, free in zip(along.tolist(), passed.tolist(), strict=True):
            if not free or at - last > LONGEST_UNSEEN:
                begin = inf
            if free:
                begin = min(begin, max(at - beside, -half))
                widest = max(widest, min(at + beside, half) - begin)
            last = at
        return widest
