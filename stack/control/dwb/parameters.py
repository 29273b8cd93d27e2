"""Settings of the dynamic window controller."""

from __future__ import annotations

from dataclasses import dataclass

from stack.control.goal_alignment import EndsParameters
from stack.parameters import parameter


@dataclass(frozen=True)
class DwbParameters(EndsParameters):
    """Settings of `Dwb`. Names and meanings of the critics follow Nav2's; a weight of 0 is off."""

    reverse_speed: float = parameter(
        0.1, "m/s", at_least=0.0, help="top speed backward; 0 never reverses"
    )
    linear_samples: int = parameter(20, at_least=2, at_most=200, help="forward speeds tried")
    angular_samples: int = parameter(21, at_least=3, at_most=201, help="turning speeds tried")
    lateral_samples: int = parameter(
        5, at_least=3, at_most=51, help="omnidirectional robots only: sideways speeds tried"
    )
    simulation_time: float = parameter(
        1.7, "s", above=0.2, at_most=10.0, help="how far ahead each pair of speeds is driven"
    )
    simulation_step: float = parameter(
        0.1, "s", above=0.01, at_most=0.5, help="between the poses looked at"
    )
    path_distance_weight: float = parameter(
        24.0, at_least=0.0, help="distance of the end from the path, per metre"
    )
    goal_distance_weight: float = parameter(
        6.0, at_least=0.0, help="way left on the path after the end, per metre"
    )
    path_align_weight: float = parameter(
        2.0, at_least=0.0, help="distance of a point before the robot from the path, per metre"
    )
    goal_align_weight: float = parameter(
        1.0, at_least=0.0, help="way left on the path from a point before the robot, per metre"
    )
    forward_point: float = parameter(
        0.3, "m", above=0.0, help="how far before the robot that point is"
    )
    obstacle_weight: float = parameter(
        2.0, at_least=0.0, help="highest costmap cost on the way, as a share of 252"
    )
    prefer_forward_weight: float = parameter(
        1.0, at_least=0.0, help="driving backward, or turning with little speed"
    )
    twirling_weight: float = parameter(0.05, at_least=0.0, help="turning speed, per rad/s")
    oscillation_distance: float = parameter(
        0.05, "m", at_least=0.0, help="after a change of direction it is kept for this far"
    )
    oscillation_angle: float = parameter(
        0.2, "rad", at_least=0.0, help="or for this much of a turn"
    )
