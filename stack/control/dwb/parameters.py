"""Parameters of the dynamic window controller."""

from __future__ import annotations

from dataclasses import dataclass

from stack.control.goal_alignment import GoalAlignmentParameters
from stack.parameters import parameter


@dataclass(frozen=True)
class DwbParameters(GoalAlignmentParameters):
    """Parameters of `Dwb`. The critics follow Nav2's; a weight of 0 turns a critic off."""

    reverse_speed: float = parameter(
        0.1, "m/s", at_least=0.0, robot_limit="reverse_speed", public=True,
        help="top speed backward; 0: never reverse",
    )  # fmt: skip
    linear_samples: int = parameter(20, at_least=2, at_most=200, help="number of forward speeds")
    angular_samples: int = parameter(21, at_least=3, at_most=201, help="number of turning speeds")
    simulation_time: float = parameter(
        1.7, "s", above=0.2, at_most=10.0, help="simulated time of each sample"
    )
    simulation_step: float = parameter(
        0.1, "s", above=0.01, at_most=0.5, help="time between two simulated poses"
    )
    path_distance_weight: float = parameter(
        24.0, at_least=0.0, help="weight of the mean distance to the path, per metre"
    )
    goal_distance_weight: float = parameter(
        6.0, at_least=0.0, help="weight of the path remaining at the end, per metre"
    )
    path_align_weight: float = parameter(
        2.0, at_least=0.0, help="weight of the path distance of a point ahead, per metre"
    )
    goal_align_weight: float = parameter(
        1.0, at_least=0.0, help="weight of the path remaining from a point ahead, per metre"
    )
    forward_point: float = parameter(
        0.3, "m", above=0.0, help="distance of the point ahead of the robot"
    )
    obstacle_weight: float = parameter(
        2.0, at_least=0.0, help="weight of the highest costmap cost, as a share of 252"
    )
    prefer_forward_weight: float = parameter(
        1.0, at_least=0.0, help="weight of driving backward and of turning in place"
    )
    twirling_weight: float = parameter(
        0.05, at_least=0.0, help="weight of the turning speed, per rad/s"
    )
    oscillation_distance: float = parameter(
        0.05, "m", at_least=0.0, help="a new direction is kept for this distance"
    )
    oscillation_angle: float = parameter(
        0.2, "rad", at_least=0.0, help="or for a turn by this angle"
    )
