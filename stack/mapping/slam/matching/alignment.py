"""Alignment of a scan with the keyframes around it, from the pose that odometry predicts."""

from __future__ import annotations

from dataclasses import replace
from math import hypot

import numpy as np

from stack.mapping.slam.matching.local_map import LocalMap, ScanMatch
from stack.mapping.slam.matching.scans import PreparedScan
from stack.mapping.slam.odometry.error import FASTEST, odometry_deviation
from stack.types import FloatArray, Pose2D, wrap_angle

GOOD_OVERLAP = 0.75
"""Below this, an alignment from the predicted pose is compared with a search."""

POOR_OVERLAP, WIDE_WINDOW = 0.6, (1.0, 1.4)
"""Below this a scan is searched in a window of metres and radians: odometry was lost for a while,
as after a gap in the measurements or a slip."""

LARGE_STEP, LARGE_TURN = 0.4, 0.5
"""Metres and radians between two scans above which the scan is also searched near the last pose, if
the motion is faster than FASTEST: odometry was reset, or reports at once what it has missed."""

MOST_WINDOW = (3.0, 1.5)
"""Metres and radians: half width of a search around the pose that odometry predicts, at most."""

LEAST_OVERLAP, CONFIRMED_OVERLAP = 0.5, 0.12
"""Overlap that a match needs, and one that odometry confirms: within 2.5 of its deviations. In a
door most of a scan is new, and what remains gives the heading better than odometry does."""

WEAK_HEADING = 0.2
"""Radians: deviation of the odometry's heading in an alignment. Walls determine the heading almost
always; a stronger pull by odometry that turns too little adds up to metres."""

NORMAL_VARIANCE = 0.03**2
"""rad²; of normals: a wall seems to hold a scan along it by this share of its points."""

EDGE_FLOOR = np.diag([0.005, 0.005, 0.002]) ** 2
"""Covariance added to that of a match: errors that its points share."""


def align_step(
    local: LocalMap, scan: PreparedScan, pose: Pose2D, moved: Pose2D, elapsed: float
) -> tuple[Pose2D, ScanMatch]:
    """Return the pose of a scan and its match; the pose of odometry if it does not match.

    A match that is not accepted has no information.

    Args:
        local: surroundings, map frame.
        scan: base frame.
        pose: of the base at the scan before, map frame.
        moved: the motion since then by odometry, frame of that pose.
        elapsed: seconds since then; 0 if unknown.
    """
    expected = pose.compose(moved)
    far, turned = hypot(moved.x, moved.y), abs(moved.heading)
    position, heading = odometry_deviation(moved)
    prior = np.diag([position**-2, position**-2, WEAK_HEADING**-2])
    found = local.align(scan, expected, (expected, prior))
    likely = (position, heading)
    window = (
        min(2.5 * position + 0.05, MOST_WINDOW[0]), min(2.5 * heading + 0.02, MOST_WINDOW[1])
    )  # fmt: skip
    searches = [(expected, window, GOOD_OVERLAP)]
    if far > max(LARGE_STEP, FASTEST * elapsed) or turned > max(LARGE_TURN, FASTEST * elapsed):
        searches.append((pose, (LARGE_STEP, LARGE_TURN), 1.0))
    searches.append((expected, WIDE_WINDOW, POOR_OVERLAP))
    for centre, window, good in searches:
        if found.overlap >= good:
            continue
        searched = local.search(scan, centre, window, deviations=likely)
        if searched is not None:
            other = local.align(scan, searched)
            if other.overlap > found.overlap + 0.05:
                found = other
    turned = abs(wrap_angle(found.pose.heading - expected.heading))
    confirms = found.pose.distance_to(expected) <= 2.5 * position and turned <= 2.5 * heading
    if found.overlap > (CONFIRMED_OVERLAP if confirms else LEAST_OVERLAP):
        return found.pose, found
    return expected, replace(found, information=np.zeros((3, 3)))


def softened(information: FloatArray) -> FloatArray:
    """Return the information after adding EDGE_FLOOR to the covariance; it may be singular.

    What the errors of normals alone would tell is taken out: along a bare corridor nothing is left.
    """
    spurious = NORMAL_VARIANCE * float(information[0, 0] + information[1, 1])
    values, axes = np.linalg.eigh(information - np.diag([spurious, spurious, 0.0]))
    information = (axes * np.maximum(values, 0.0)) @ axes.T
    softer: FloatArray = information @ np.linalg.inv(np.eye(3) + EDGE_FLOOR @ information)
    return 0.5 * (softer + softer.T)
