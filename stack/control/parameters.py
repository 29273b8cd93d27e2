"""Parameters common to all controllers."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

from stack.components import GoalTolerance
from stack.parameters import parameter

STOP_SHARE = 0.5
"""Share of a tolerance within which a controller stops: the rest is for errors of the pose."""


@dataclass(frozen=True)
class FollowingParameters:
    """Parameters of path following, inherited by each controller."""

    cruise_speed: float = parameter(
        0.8, "m/s", above=0.0, at_most=5.0, robot_limit="linear_speed", public=True,
        help="speed on a clear path, within the robot's limit",
    )  # fmt: skip
    response_time: float = parameter(
        0.1, "s", at_least=0.0, help="delay from a command to the robot's response"
    )
    stop_distance: float = parameter(
        0.03, "m", above=0.0, help="distance to the goal at which the robot turns to its heading"
    )
    turn_precision: float = parameter(
        0.02, "rad", above=0.0, help="heading error at which a turn in place ends"
    )

    def within(self, tolerance: GoalTolerance) -> Self:
        """Return the parameters with which the robot stops inside a tolerance."""
        return replace(
            self,
            stop_distance=min(self.stop_distance, STOP_SHARE * tolerance.position),
            turn_precision=min(self.turn_precision, STOP_SHARE * tolerance.heading),
        )

    def final_speed(self, lowest: float, period: float) -> float:
        """Lowest speed near the goal, m/s: slow enough to stop at it in spite of the delay.

        Args:
            lowest: usual speed there, m/s.
            period: seconds between two commands.
        """
        return min(lowest, self.stop_distance / (self.response_time + period))
