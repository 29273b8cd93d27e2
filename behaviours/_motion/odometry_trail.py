"""Recent odometry: distance driven, and motion since a stamp."""

from __future__ import annotations

from collections import deque

from stack.types import Pose2D, wrap_angle

MEMORY = 3.0
"""Length of the history, seconds."""


class OdometryTrail:
    """Odometry poses of the last seconds, recorded once per tick."""

    def __init__(self) -> None:
        self.distance = 0.0
        self._poses: deque[tuple[float, Pose2D]] = deque()

    def record(self, time: float, pose: Pose2D) -> None:
        """Add the current pose (odom frame); `distance` grows by the step from the previous one."""
        if self._poses:
            self.distance += pose.distance_to(self._poses[-1][1])
        self._poses.append((time, pose))
        while time - self._poses[0][0] > MEMORY:
            self._poses.popleft()

    def at(self, stamp: float) -> Pose2D:
        """Return the odom-frame pose at a stamp: interpolated, clamped to the recorded times."""
        later = next((n for n, (time, _) in enumerate(self._poses) if time >= stamp), None)
        if later is None:
            return self._poses[-1][1]
        (after, end), (before, start) = self._poses[later], self._poses[max(later - 1, 0)]
        share = (stamp - before) / (after - before) if after > before else 0.0
        share = min(max(share, 0.0), 1.0)
        return Pose2D(
            start.x + share * (end.x - start.x),
            start.y + share * (end.y - start.y),
            wrap_angle(start.heading + share * wrap_angle(end.heading - start.heading)),
        )

    def since(self, stamp: float) -> Pose2D:
        """Return the current pose relative to the pose at the stamp."""
        return self._poses[-1][1].relative_to(self.at(stamp))
