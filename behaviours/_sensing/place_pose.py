"""Hypotheses of the robot's pose from keyframes that a picture resembles, refined by the scan."""

from __future__ import annotations

from collections.abc import Sequence
from math import radians

from behaviours._sensing.marker_pose import Fit, Hypothesis
from stack.types import PlaceSighting, Pose2D

RIVAL_SHARE = 0.67
"""Share of the best pose's inliers from which another pose that fits makes a picture ambiguous."""

STEPS = ((0.08, radians(2.4)), (0.04, radians(1.2)), (0.02, radians(0.6)), (0.01, radians(0.3)))
"""Steps of the refinement, metres and radians."""

MOST_MOVES = 6
"""Moves with steps of one size."""

LARGEST_MOVE = 0.25
"""Metres that the refinement moves a pose at most."""


def refined(pose: Pose2D, fit: Fit) -> tuple[Pose2D, float]:
    """Return the pose near this one where the scan fits best, and its fit.

    Moves along x, y and heading with smaller and smaller steps as long as the fit improves.
    """
    best, health = pose, fit(pose)
    for step, turn in STEPS:
        for _ in range(MOST_MOVES):
            moves = [
                best.compose(Pose2D(dx, dy, turning))
                for dx, dy, turning in (
                    (step, 0.0, 0.0), (-step, 0.0, 0.0), (0.0, step, 0.0), (0.0, -step, 0.0),
                    (0.0, 0.0, turn), (0.0, 0.0, -turn),
                )
            ]  # fmt: skip
            fits = [fit(one) if one.distance_to(pose) <= LARGEST_MOVE else -1.0 for one in moves]
            index = max(range(len(moves)), key=lambda n: (round(fits[n], 6), -n))
            if fits[index] <= health + 1e-6:
                break
            best, health = moves[index], fits[index]
    return best, health


def place_hypothesis(
    sightings: Sequence[PlaceSighting], at_stamp: Pose2D, now: Pose2D, fit: Fit, min_fit: float
) -> Hypothesis | None:
    """Return the hypothesis of a picture; None without one, or if two places explain it equally.

    Args:
        sightings: of one picture, most inliers first.
        at_stamp: odometry pose at the picture's stamp.
        now: odometry pose at the stamp of the scan that `fit` evaluates.
        fit: fit of the newest scan to the map at a pose, in [0, 1].
        min_fit: poses with less are no hypotheses.
    """
    since, found = now.relative_to(at_stamp), []
    for sighting in sightings:
        pose, health = refined(sighting.pose.compose(since), fit)
        if health >= min_fit:
            map_from_odom = pose.compose(now.inverse())
            support = sighting.error, (sighting.stamp,), "appearance", sighting.inliers
            found.append(Hypothesis(map_from_odom, health, *support))
    if not found or any(one.inliers >= RIVAL_SHARE * found[0].inliers for one in found[1:]):
        return None
    return found[0]
