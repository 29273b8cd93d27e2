"""Parameters of the model predictive path integral (MPPI) controller."""

from __future__ import annotations

from dataclasses import dataclass

from stack.control.goal_alignment import GoalAlignmentParameters
from stack.parameters import parameter


@dataclass(frozen=True)
class MppiParameters(GoalAlignmentParameters):
    """Parameters of `Mppi`. The motion model follows the robot; the critics follow Nav2's.

    A critic's cost is (weight × term) ** power; a weight of 0 turns the critic off.
    """

    reverse_speed: float = parameter(
        0.2, "m/s", at_least=0.0, robot_limit="reverse_speed", public=True,
        help="top speed backward; 0: never reverse",
    )  # fmt: skip
    blind_speed: float = parameter(
        0.15, "m/s", at_least=0.0, help="top speed backward into ground that no sensor covers"
    )
    lateral_speed: float = parameter(
        0.5, "m/s", at_least=0.0, public=True,
        help="omni only: top lateral speed; 0: never sideways",
    )  # fmt: skip
    batch: int = parameter(
        2000, at_least=16, at_most=20000, public=True, help="rollouts per command"
    )
    steps: int = parameter(56, at_least=8, at_most=400, public=True, help="steps of a rollout")
    time_step: float = parameter(0.05, "s", above=0.0, at_most=0.5, help="length of a step")
    iterations: int = parameter(1, at_least=1, at_most=10, help="optimisations per command")
    temperature: float = parameter(
        0.3, above=0.0, help="low values follow the best rollouts, high values average more of them"
    )
    gamma: float = parameter(
        0.015, at_least=0.0, help="cost of deviations from the last plan: higher is smoother"
    )
    linear_deviation: float = parameter(
        0.2, "m/s", above=0.0, help="standard deviation of the sampled forward speeds"
    )
    lateral_deviation: float = parameter(
        0.2, "m/s", above=0.0, help="omni only: standard deviation of the sampled lateral speeds"
    )
    angular_deviation: float = parameter(
        0.4, "rad/s", above=0.0, help="standard deviation of the sampled turning speeds"
    )

    constraint_weight: float = parameter(
        4.0, at_least=0.0, help="weight of commands beyond the limits"
    )
    constraint_power: int = parameter(1, at_least=1, at_most=4, help="power of this critic")
    cost_weight: float = parameter(
        3.8, at_least=0.0, help="weight of the costmap cost under the base"
    )
    cost_power: int = parameter(1, at_least=1, at_most=4, help="power of this critic")
    obstacles_weight: float = parameter(
        30.0, at_least=0.0, help="weight of obstacles nearer than obstacles_margin"
    )
    obstacles_power: int = parameter(1, at_least=1, at_most=4, help="power of this critic")
    obstacles_margin: float = parameter(
        0.2, "m", at_least=0.0, help="desired clearance around the footprint"
    )
    critical_margin: float = parameter(
        0.04, "m", at_least=0.0, help="clearance around the footprint with the critical weight"
    )
    moving_weight: float = parameter(
        150.0, at_least=0.0, help="weight of moving objects nearer than moving_margin; 0: ignore"
    )
    moving_margin: float = parameter(
        0.5, "m", at_least=0.0, help="desired clearance from the predicted positions of people"
    )
    near_goal: float = parameter(
        0.5, "m", at_least=0.0,
        help="remaining path at which only collisions count, not costs and clearance",
    )  # fmt: skip
    goal_weight: float = parameter(
        5.0, at_least=0.0, help="weight of the distance to the goal, near it"
    )
    goal_power: int = parameter(1, at_least=1, at_most=4, help="power of this critic")
    goal_range: float = parameter(
        1.4, "m", above=0.0, help="remaining path at which the goal counts instead of the path"
    )
    goal_angle_weight: float = parameter(
        3.0, at_least=0.0, help="weight of the heading error near the goal"
    )
    goal_angle_power: int = parameter(1, at_least=1, at_most=4, help="power of this critic")
    goal_angle_range: float = parameter(
        0.5, "m", above=0.0, help="remaining path at which the goal's heading counts"
    )
    path_align_weight: float = parameter(
        14.0, at_least=0.0, help="weight of the distance to the path at equal length driven"
    )
    path_align_power: int = parameter(1, at_least=1, at_most=4, help="power of this critic")
    path_align_occupied: float = parameter(
        0.07, at_least=0.0, at_most=1.0, help="blocked share of the path that turns path align off"
    )
    path_angle_weight: float = parameter(
        2.2, at_least=0.0, help="weight of the angle to the path ahead, when it is large"
    )
    path_angle_power: int = parameter(1, at_least=1, at_most=4, help="power of this critic")
    path_angle_least: float = parameter(
        0.785, "rad", at_least=0.0, help="angle to the path above which path angle applies"
    )
    path_follow_weight: float = parameter(
        5.0, at_least=0.0, help="weight of the distance to a path point ahead"
    )
    path_follow_power: int = parameter(1, at_least=1, at_most=4, help="power of this critic")
    prefer_forward_weight: float = parameter(
        5.0, at_least=0.0, help="weight of the metres driven backward"
    )
    prefer_forward_power: int = parameter(1, at_least=1, at_most=4, help="power of this critic")
    time_to_collision: float = parameter(
        1.0, "s", above=0.0, help="a command must be free of collisions for this long"
    )
