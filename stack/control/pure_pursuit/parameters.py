"""Parameters of regulated pure pursuit."""

from __future__ import annotations

from dataclasses import dataclass

from stack.control.parameters import FollowingParameters
from stack.parameters import parameter


@dataclass(frozen=True)
class PurePursuitParameters(FollowingParameters):
    """Parameters of `PurePursuit`."""

    min_speed: float = parameter(
        0.15, "m/s", above=0.0, help="lower limit of the speed regulated by curvature and cost"
    )
    creep_speed: float = parameter(
        0.05, "m/s", above=0.0, help="minimum speed near the goal or an obstacle"
    )
    lookahead_time: float = parameter(
        1.0, "s", above=0.0, public=True, help="lookahead distance divided by the speed"
    )
    min_lookahead: float = parameter(
        0.3, "m", above=0.0, not_above="max_lookahead", public=True,
        help="minimum lookahead distance",
    )  # fmt: skip
    max_lookahead: float = parameter(
        0.9, "m", above=0.0, public=True, help="maximum lookahead distance"
    )
    min_radius: float = parameter(
        0.9, "m", at_least=0.0, help="radius of arcs below which the speed falls in proportion"
    )
    cost_slowdown: float = parameter(
        0.5, at_least=0.0, at_most=1.0, help="share of speed lost at the highest passable cost"
    )
    turn_angle: float = parameter(
        0.785, "rad", above=0.0, help="angle to the path above which the robot turns in place"
    )
    turn_speed: float = parameter(
        1.4, "rad/s", above=0.0, robot_limit="angular_speed", public=True,
        help="top speed of turns in place",
    )  # fmt: skip
    stop_distance: float = parameter(
        0.01, "m", above=0.0, help="remaining path at which the robot turns to the goal's heading"
    )
    time_to_collision: float = parameter(
        1.0, "s", above=0.0, help="slows down when a collision is nearer than this"
    )
    clearance: float = parameter(
        0.06, "m", at_least=0.0, help="distance kept to an obstacle on the arc"
    )
    omni_heading: str = parameter(
        "path", one_of=("path", "goal"), public=True,
        help="omnidirectional robots only: heading along the path, or the goal's heading",
    )  # fmt: skip
    padding: float = parameter(
        0.015, "m", at_least=0.0, at_most=0.5, help="distance kept free around the footprint"
    )
