"""Way since the newest keyframe: the edge that odometry makes to the next one."""

from __future__ import annotations

from math import hypot

import numpy as np

from stack.mapping.slam.graph import Edge, Keyframe
from stack.mapping.slam.odometry.error import odometry_information
from stack.types import FloatArray, Pose2D

CHAIN_LENGTH = 3.0
"""Metres driven since the newest keyframe up to which odometry connects the next one with it."""

LOST_DISTANCE, LOST_HEADING = 2.0, 1.8
"""Metres and radians: deviations of a motion that is unknown; any heading is about as likely."""


class OdometryChain:
    """Odometry since the newest keyframe, and what the scans have shown of its errors."""

    def __init__(self) -> None:
        self._newest: Keyframe | None = None
        self._driven, self._doubt = 0.0, np.zeros(3)

    def begin(self, keyframe: Keyframe | None) -> None:
        """Begin at a new keyframe; None: odometry connects nothing until there is another one."""
        self._newest, self._driven, self._doubt = keyframe, 0.0, np.zeros(3)

    def drive(self, distance: float) -> None:
        """Add metres driven."""
        self._driven += distance
        if self._driven > CHAIN_LENGTH:
            self._newest = None

    def doubt(self, errors: FloatArray) -> None:
        """Add squared errors (3,) of x, y and heading beyond the covariance of odometry."""
        self._doubt = self._doubt + errors

    def edge_to(self, new: Keyframe) -> Edge | None:
        """Return the edge to a new keyframe, as uncertain as odometry has proved to be."""
        before = self._newest
        if before is None:
            return None
        moved = new.odometry.relative_to(before.odometry)
        covariance = np.linalg.inv(odometry_information(moved)) + np.diag(self._doubt)
        return Edge(before.id, new.id, moved, np.linalg.inv(covariance), "odometry")


def lost_edge(last: Keyframe, new: Keyframe) -> Edge:
    """Return the edge to a keyframe of which neither odometry nor scans tell where it is."""
    relative: Pose2D = new.pose.relative_to(last.pose)
    position = LOST_DISTANCE + hypot(relative.x, relative.y)
    information = np.diag([position**-2, position**-2, LOST_HEADING**-2])
    return Edge(last.id, new.id, relative, information, "odometry")
