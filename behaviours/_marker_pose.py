"""Which pose of the robot explains a marker sighting: both solutions, tried against the map.

A square seen from afar has two poses that explain its picture nearly as well (IPPE, Collins and
Bartoli, 2014), and even the right one is poor in one direction only: the marker's bearing and
distance are sharp, the angle it is seen under is not. So each candidate is swung about the marker
to where the lidar fits the map best.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from math import cos, radians, sin

import numpy as np

from stack.types import MarkerSighting, Pose2D, wrap_angle

Fit = Callable[[Pose2D], float]

SWINGS = tuple(radians(angle) for angle in np.arange(-18.0, 18.1, 2.0))
STRETCHES = (0.92, 0.96, 1.0, 1.04, 1.08)
FINE_SWINGS = tuple(radians(angle) for angle in np.arange(-1.5, 1.6, 0.5))
SAME_PLACE, SAME_HEADING = 0.4, radians(12.0)


@dataclass(frozen=True, slots=True)
class Hypothesis:
    """Where the robot may be.

    Attributes:
        map_from_odom: the odom frame in the map frame, which stays the same while it drives.
        fit: of the scan with the map there, in [0, 1].
        error: reprojection error, pixels.
        stamps: of the pictures that say so, seconds.
    """

    map_from_odom: Pose2D
    fit: float
    error: float
    stamps: tuple[float, ...]

    def pose(self, odometry: Pose2D) -> Pose2D:
        """The robot's pose in the map frame when its odometry says this."""
        return self.map_from_odom.compose(odometry)


def swung(pose: Pose2D, centre: tuple[float, float], angle: float, stretch: float) -> Pose2D:
    """The pose turned about a point by an angle, its distance to the point stretched."""
    dx, dy = stretch * (pose.x - centre[0]), stretch * (pose.y - centre[1])
    c, s = cos(angle), sin(angle)
    return Pose2D(
        centre[0] + c * dx - s * dy, centre[1] + s * dx + c * dy, wrap_angle(pose.heading + angle)
    )


def best_fit(pose: Pose2D, centre: tuple[float, float], fit: Fit) -> tuple[Pose2D, float]:
    """The best-fitting pose near this one that sees the marker at `centre` in the same direction.

    One coordinate after the other: swing, distance, swing again in small steps. Of equals, the
    one nearest to the candidate.
    """

    def best(tried: Iterable[Pose2D]) -> Pose2D:
        return max(tried, key=lambda one: (round(fit(one), 6), -one.distance_to(pose)))

    found = best(swung(pose, centre, angle, 1.0) for angle in SWINGS)
    found = best(swung(found, centre, 0.0, stretch) for stretch in STRETCHES)
    found = best(swung(found, centre, angle, 1.0) for angle in FINE_SWINGS)
    return found, fit(found)


def hypotheses(
    sighting: MarkerSighting, at_stamp: Pose2D, now: Pose2D, fit: Fit
) -> list[Hypothesis]:
    """What a sighting says, a hypothesis for each of its candidates, best fit first.

    Args:
        sighting: with poses of the base at the picture's stamp.
        at_stamp: odometry when the picture was exposed.
        now: odometry when the scan was taken that `fit` looks at.
        fit: health of the newest scan at a pose, in [0, 1].
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
    """All hypotheses, those of the same place made one (the better fit, the stamps of both)."""
    result = list(known)
    for one in new:
        for index, other in enumerate(result):
            if _agree(one.pose(odometry), other.pose(odometry)):
                best = max(one, other, key=lambda each: (each.fit, -each.error))
                stamps = tuple(sorted({*one.stamps, *other.stamps}))
                result[index] = Hypothesis(best.map_from_odom, best.fit, best.error, stamps)
                break
        else:
            result.append(one)
    return sorted(result, key=lambda one: (-one.fit, one.error))


def _agree(one: Pose2D, other: Pose2D) -> bool:
    turn = abs(wrap_angle(one.heading - other.heading))
    return one.distance_to(other) <= SAME_PLACE and turn <= SAME_HEADING
