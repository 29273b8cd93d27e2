"""Turns towards a path that lies far off the robot's heading, before its controller takes over."""

from __future__ import annotations

from math import asin

from stack.components import ControlState
from stack.control.path_progress import PathProgress
from stack.types import Pose2D, wrap_angle

LOOKAHEAD = 0.4
"""Metres ahead on the path whose direction counts."""

CLOSE = 0.15
"""Metres to the goal from which a robot makes straight for it, however little that takes."""

DISENGAGE = 0.3
"""Share of the angle that begins a turn at which the turn ends."""

STANDING = 0.1
"""Speed in m/s up to which a turn is begun; above it only when the path lies behind."""

BEHIND = 2.0
"""Radians off the heading from which a path lies behind."""


class RotationShim:
    """Decides when to turn in place first. Nav2's rotation shim controller does the same."""

    def __init__(self) -> None:
        self._turning = False

    def angle(
        self, track: PathProgress, state: ControlState, least: float, precision: float
    ) -> float | None:
        """The angle to turn by now, None when the path may be driven.

        Args:
            track: of the path, advanced to the pose.
            state: of the robot.
            least: radians off the path that begin a turn.
            precision: metres by which the goal may be missed.
        """
        pose, goal = state.pose, track.path.goal
        distance = pose.distance_to(goal)
        if track.remaining > LOOKAHEAD:
            x, y = track.nearer_point(pose, LOOKAHEAD)
            goal = Pose2D(x, y)
        elif distance <= precision:
            self._turning = False
            return None
        elif distance <= CLOSE:
            least = min(least, asin(precision / distance))
        angle = wrap_angle(pose.bearing_to(goal) - pose.heading)
        if self._turning:
            self._turning = abs(angle) > DISENGAGE * least
        else:
            standing = abs(state.twist.linear) <= STANDING
            self._turning = abs(angle) > (least if standing else max(least, BEHIND))
        return angle if self._turning else None
