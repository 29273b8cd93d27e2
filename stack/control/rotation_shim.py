"""Rotation shim: decides when to turn in place towards the path before driving along it."""

from __future__ import annotations

from math import asin

from stack.components import ControlState
from stack.geometry.path_segment import PathSegment
from stack.types import Pose2D, wrap_angle

CLOSE = 0.15
"""Distance in metres to the goal below which smaller angles to it also start a turn."""

STANDING = 0.1
"""Speed in m/s up to which a turn starts; above it only when the path is behind."""

BEHIND = 2.0
"""Angle in radians above which the path is behind the robot."""


class RotationShim:
    """Decides when to turn in place first, like Nav2's rotation shim controller.

    Args:
        lookahead: distance of the path point to turn towards, metres.
        disengage: share of the starting angle at which a turn ends.
    """

    def __init__(self, lookahead: float, disengage: float) -> None:
        self._lookahead, self._disengage = lookahead, disengage
        self._turning = False

    def angle(
        self, segment: PathSegment, state: ControlState, least: float, precision: float
    ) -> float | None:
        """Return the angle to turn by, radians; None when the robot can drive along the path.

        Args:
            segment: that the robot drives, up to date with its pose.
            state: of the robot.
            least: angle to the path that starts a turn, radians.
            precision: position tolerance at the goal, metres.
        """
        pose, goal = state.pose, segment.path.goal
        distance = pose.distance_to(goal)
        if segment.remaining > self._lookahead:
            x, y = segment.nearer_point(pose, self._lookahead)
            goal = Pose2D(x, y)
        elif distance <= precision:
            self._turning = False
            return None
        elif distance <= CLOSE:
            least = min(least, asin(precision / distance))
        angle = wrap_angle(pose.bearing_to(goal) - pose.heading)
        if self._turning:
            self._turning = abs(angle) > self._disengage * least
        else:
            standing = abs(state.twist.linear) <= STANDING
            self._turning = abs(angle) > (least if standing else max(least, BEHIND))
        return angle if self._turning else None
