"""Turns towards a path that lies far off the robot's heading, before its controller takes over."""

from __future__ import annotations

from stack.components import ControlState
from stack.control.track import Track
from stack.types import Pose2D, wrap_angle

LOOKAHEAD = 0.4
"""Metres ahead on the path whose direction counts."""

NEAREST = 0.1
"""A point nearer than this, in metres, has no direction worth turning to."""

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

    def angle(self, track: Track, state: ControlState, least: float) -> float | None:
        """The angle to turn by now, None when the path may be driven.

        Args:
            track: of the path, advanced to the pose.
            state: of the robot.
            least: radians off the path that begin a turn.
        """
        distance = min(LOOKAHEAD, track.remaining)
        if distance < NEAREST:
            self._turning = False
            return None
        x, y = track.nearer_point(state.pose, distance)
        angle = wrap_angle(state.pose.bearing_to(Pose2D(x, y)) - state.pose.heading)
        if self._turning:
            self._turning = abs(angle) > DISENGAGE * least
        else:
            standing = abs(state.twist.linear) <= STANDING
            self._turning = abs(angle) > (least if standing else max(least, BEHIND))
        return angle if self._turning else None
