"""Further sources of pose and twist: visual odometry, optical flow, a second set of wheels."""

from __future__ import annotations

import numpy as np

from stack.localisation.fusion import kernels
from stack.localisation.fusion.history import History
from stack.localisation.fusion.measurements import StateMeasurement
from stack.localisation.fusion.parameters import POSE_AXES, TWIST_AXES, SourceParameters
from stack.types import Observation, Odometry, Pose2D


class Source:
    """Measurements of one sensor for the filter: chosen axes, gate, timeout.

    The poses of most sources are in a frame of their own. It is aligned with the odom frame at the
    first measurement, and again after `timeout` without an accepted one.

    Args:
        parameters: of the source.
    """

    def __init__(self, parameters: SourceParameters) -> None:
        self.parameters = parameters
        self._odom_from_source: Pose2D | None = None
        self._accepted: float | None = None

    def fuse(self, observation: Observation, history: History) -> None:
        """Update the filter with the source's measurement, if the observation has one."""
        p = self.parameters
        measured = observation.named(p.sensor, Odometry)
        if measured is None:
            return
        stamp = measured.stamp
        silent = self._accepted is not None and stamp - self._accepted > p.timeout
        if p.pose and p.aligned and (self._odom_from_source is None or silent):
            node = history.at(stamp)
            if node is None:
                return
            self._odom_from_source = node.pose.compose(measured.pose.inverse())
            self._accepted = stamp
        node = history.add(self._measurement(measured))
        if node is None or node.distance <= p.gate:
            self._accepted = stamp

    def _measurement(self, measured: Odometry) -> StateMeasurement:
        p = self.parameters
        pose, twist = measured.pose, measured.twist
        if self._odom_from_source is not None:
            pose = self._odom_from_source.compose(pose)
        values = (pose.x, pose.y, pose.heading, twist.linear, twist.lateral, twist.angular)
        deviations = (
            p.position_deviation, p.position_deviation, p.heading_deviation,
            p.speed_deviation, p.speed_deviation, p.turn_deviation,
        )  # fmt: skip
        parts = (
            *(part for part, axis in enumerate(POSE_AXES) if axis in p.pose),
            *(kernels.TWIST + part for part, axis in enumerate(TWIST_AXES) if axis in p.twist),
        )
        variances = [deviations[part] ** 2 for part in parts]
        return StateMeasurement(
            measured.stamp, p.sensor, parts, np.array([values[part] for part in parts]),
            np.diag(variances), p.gate,
        )  # fmt: skip
