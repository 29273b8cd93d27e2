"""Range smoothing: reduces the noise of lidar ranges without moving walls or rounding corners.

What decides whether the robot may pass (costmaps, controllers, collision monitor) uses smoothed
scans: of hundreds of beams on a wall a few are off by three standard deviations, and those few
would close every gap that is only centimetres wider than the robot.
"""

from __future__ import annotations

import numpy as np

from stack.types import Observation, Scan

SPAN = 0.015
"""Metres to either side, across the beams, of the ranges that are averaged."""

NEIGHBOURS = 8
"""Largest number of beams to either side that are averaged."""

SAME_SURFACE = 0.03
"""Metres between a range and the mean of two beams beside it if all are on one surface: three
standard deviations of the noise of a common lidar (1 cm)."""


def smooth_observation(observation: Observation) -> Observation:
    """Return the observation with its scans smoothed."""
    scans = observation.of(Scan)
    if not scans:
        return observation
    smooth = {name: smoothed(scan) for name, scan in scans.items()}
    return Observation(observation.time, {**observation.measurements, **smooth})


def smoothed(scan: Scan) -> Scan:
    """Return the scan with each range averaged over pairs of beams at equal angles beside it.

    A sigma filter (J.-S. Lee, "Digital image smoothing and the sigma filter", Computer Vision,
    Graphics, and Image Processing 24(2), 1983) over symmetric pairs, which keep the position of an
    inclined wall; points stay on their beams. A pair counts if it is at most SPAN away and its mean
    is within SAME_SURFACE of the range. A convex corner appears deeper than it is: a right-angled
    one by SPAN / 2, the sharpest by 2/3 SAME_SURFACE, since its pairs are deeper in proportion to
    their distance. What a single beam sees, and the edge of a surface, stay as they are.
    """
    ranges, angles = scan.ranges.astype(np.float64), scan.angles
    total, count = ranges.copy(), np.ones(ranges.size)
    with np.errstate(invalid="ignore"):  # inf - inf: beams without return
        for shift in range(1, min(NEIGHBOURS, (ranges.size - 1) // 2) + 1):
            middle, pair = ranges[shift:-shift], ranges[: -2 * shift] + ranges[2 * shift :]
            width = np.abs(angles[2 * shift :] - angles[: -2 * shift]) * middle
            near = width <= 2.0 * SPAN
            if not near.any():
                break
            counts = near & (np.abs(0.5 * pair - middle) <= SAME_SURFACE)
            total[shift:-shift] += np.where(counts, pair, 0.0)
            count[shift:-shift] += 2.0 * counts
    return scan.with_ranges((total / count).astype(np.float32))
