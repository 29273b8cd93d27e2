"""Settings that every controller has."""

from __future__ import annotations

from dataclasses import dataclass

from stack.parameters import parameter


@dataclass(frozen=True)
class FollowingParameters:
    """Settings of whatever follows a path, part of the parameters of each controller."""

    cruise_speed: float = parameter(
        0.8, "m/s", above=0.0, at_most=5.0, help="speed on a clear path; the robot's limit holds"
    )
    brake_share: float = parameter(
        0.5,
        above=0.0,
        at_most=1.0,
        help="share of the robot's accelerations used to come to a stop",
    )
    response_time: float = parameter(
        0.1, "s", at_least=0.0, help="from a command to the robot's answer"
    )
    goal_heading: float = parameter(0.02, "rad", above=0.0, help="error at which it stops turning")
    patience: float = parameter(
        1.0, "s", at_least=0.0, help="waits this long for the way to clear before it gives up"
    )
