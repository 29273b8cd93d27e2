"""Hypotheses of the robot's pose, and those from marker sightings, refined by scan matching.

A square marker at a distance has two poses with nearly the same reprojection error (IPPE, Collins
and Bartoli, 2014). Even the correct one is accurate only in bearing and distance; the viewing angle
is uncertain. Each candidate is therefore rotated about the marker to the pose where the scan fits
the map best.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from math import cos, radians, sin

import numpy as np

from stack.types import MarkerSighting, Pose2D, wrap_angle

Fit = Callable[[Pose2D], float]

TRIED_ROTATIONS = tuple(radians(angle) for angle in np.arange(-18.0, 18.1, 2.0))
DISTANCE_FACTORS = (0.92, 0.96, 1.0, 1.04, 1.08)
FINE_ROTATIONS = tuple(radians(angle) for angle in np.arange(-1.5, 1.6, 0.5))
SAME_DISTANCE, SAME_HEADING = 0.4, radians(12.0)
"""Metres and radians: hypotheses closer than this are the same pose."""

SURE_FIT, SURE_ERROR, LEAD = 0.6, 1.0, 0.05
"""A hypothesis from one picture of a marker needs this fit and reprojection error (pixels); the
best one must lead by this fit."""
SURE_INLIERS, ANOTHER_STOP = 16, 1.0
"""A hypothesis by appearance needs so many inliers in one picture, or two pictures that were taken
so many seconds apart, from two stops."""


@dataclass(frozen=True, slots=True)
class Hypothesis:
    """A hypothesis of the robot's pose.

    Attributes:
        map_from_odom: pose of the odom frame in the map frame; constant while the robot drives.
        fit: fit of the scan to the map at this pose, in [0, 1].
        error: reprojection error, pixels.
        stamps: of the pictures that support it, seconds.
        source: `marker` or `appearance`.
        inliers: features that agree on it, by appearance.
    """

    map_from_odom: Pose2D
    fit: float
    error: float
    stamps: tuple[float, ...]
    source: str = "marker"
    inliers: int = 0

    @property
    def is_sure(self) -> bool:
        """Whether it is certain enough without further pictures."""
        if self.source == "appearance":
            apart = self.stamps[-1] - self.stamps[0] >= ANOTHER_STOP
            return apart or self.inliers >= SURE_INLIERS
        return len(self.stamps) >= 2 or (self.fit >= SURE_FIT and self.error <= SURE_ERROR)

    def leads(self, rival: Hypothesis) -> bool:
        """Whether it is better than the next best one beyond doubt."""
        if self.source == rival.source == "appearance":
            return self.inliers > rival.inliers
        return self.fit - rival.fit >= LEAD or self.error < rival.error

    def pose(self, odometry: Pose2D) -> Pose2D:
        """Return the robot's pose in the map frame for its odometry pose."""
        return self.map_from_odom.compose(odometry)


def rotated(pose: Pose2D, centre: tuple[float, float], angle: float, factor: float) -> Pose2D:
    """Rotate a pose about a point by `angle`, and scale its distance to the point by `factor`."""
    dx, dy = factor * (pose.x - centre[0]), factor * (pose.y - centre[1])
    c, s = cos(angle), sin(angle)
    return Pose2D(
        centre[0] + c * dx - s * dy, centre[1] + s * dx + c * dy, wrap_angle(pose.heading + angle)
    )


def best_fit(pose: Pose2D, centre: tuple[float, float], fit: Fit) -> tuple[Pose2D, float]:
    """Return the best-fitting pose near this one with the same bearing to `centre`, and its fit.

    Searches one coordinate after the other: rotation, distance, rotation in smaller steps. Among
    equal fits the pose nearest to the candidate wins.
    """

    def best(poses: Iterable[Pose2D]) -> Pose2D:
        return max(poses, key=lambda one: (round(fit(one), 6), -one.distance_to(pose)))

    found = best(rotated(pose, centre, angle, 1.0) for angle in TRIED_ROTATIONS)
    found = best(rotated(found, centre, 0.0, factor) for factor in DISTANCE_FACTORS)
    found = best(rotated(found, centre, angle, 1.0) for angle in FINE_ROTATIONS)
    return found, fit(found)


def hypotheses(
    sighting: MarkerSighting, at_stamp: Pose2D, now: Pose2D, fit: Fit
) -> list[Hypothesis]:
    """Return one hypothesis per candidate of a sighting, best fit first.

    Args:
        sighting: its candidates are poses of the base at the picture's stamp, map frame.
        at_stamp: odometry pose at the picture's stamp.
        now: odometry pose at the stamp of the scan that `fit` evaluates.
        fit: fit of the newest scan to the map at a pose, in [0, 1].
    """
    since, centre = now.relative_to(at_stamp), sighting.marker.position[:2]
    found = []
    for candidate in sighting.candidates:
        pose, health = best_fit(candidate.pose.compose(since), centre, fit)
        map_from_odom = pose.compose(now.inverse())
        found.append(Hypothesis(map_from_odom, health, candidate.error, (sighting.stamp,)))
    return sorted(found, key=lambda one: (-one.fit, one.error))


def merged(
    known: list[Hypothesis], new: Iterable[Hypothesis], odometry: Pose2D
) -> list[Hypothesis]:
    """Merge hypotheses of the same pose: keep the better fit and the stamps of both."""
    result = list(known)
    for one in new:
        for index, other in enumerate(result):
            if _agree(one.pose(odometry), other.pose(odometry)):
                best = max(one, other, key=lambda each: (each.fit, -each.error))
                stamps = tuple(sorted({*one.stamps, *other.stamps}))
                result[index] = replace(best, stamps=stamps)
                break
        else:
            result.append(one)
    return sorted(result, key=lambda one: (-one.fit, one.error))


def _agree(one: Pose2D, other: Pose2D) -> bool:
    turn = abs(wrap_angle(one.heading - other.heading))
    return one.distance_to(other) <= SAME_DISTANCE and turn <= SAME_HEADING
