"""Parameters common to all controllers."""

from __future__ import annotations

from dataclasses import dataclass

from stack.parameters import parameter


@dataclass(frozen=True)
class FollowingParameters:
    """Parameters of path following, inherited by each controller."""

    cruise_speed: float = parameter(
        0.8, "m/s", above=0.0, at_most=5.0, robot_limit="linear_speed",
        help="speed on a clear path, within the robot's limit",
    )  # fmt: skip
    brake_share: float = parameter(
        0.5,
        above=0.0,
        at_most=1.0,
        help="share of the robot's deceleration that is used for braking",
    )
    response_time: float = parameter(
        0.1, "s", at_least=0.0, help="delay from a command to the robot's response"
    )
    turn_precision: float = parameter(
        0.02, "rad", above=0.0, help="heading error at which a turn in place ends"
    )
