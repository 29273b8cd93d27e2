"""Settings of the model-predictive path integral controller."""

from __future__ import annotations

from dataclasses import dataclass

from stack.control.goal_alignment import EndsParameters
from stack.parameters import parameter


@dataclass(frozen=True)
class MppiParameters(EndsParameters):
    """Settings of `Mppi`. How the robot can move is the robot's own; the critics follow Nav2's.

    A critic's cost is (weight × term) ** power; a weight of 0 leaves the critic out.
    """

    reverse_speed: float = parameter(
        0.2, "m/s", at_least=0.0, help="top speed backward; 0 never reverses"
    )
    lateral_speed: float = parameter(0.5, "m/s", above=0.0, help="omni only: top speed sideways")
    batch: int = parameter(2000, at_least=16, at_most=20000, help="rollouts per command")
    steps: int = parameter(56, at_least=8, at_most=400, help="steps of a rollout")
    time_step: float = parameter(0.05, "s", above=0.0, at_most=0.5, help="length of a step")
    iterations: int = parameter(1, at_least=1, at_most=10, help="optimisations per command")
    temperature: float = parameter(
        0.3, above=0.0, help="low follows the best rollouts only, high averages more of them"
    )
    gamma: float = parameter(
        0.015, at_least=0.0, help="price of noise against the last plan: smooth against lively"
    )
    linear_deviation: float = parameter(
        0.2, "m/s", above=0.0, help="standard deviation of the forward speeds tried"
    )
    lateral_deviation: float = parameter(
        0.2, "m/s", above=0.0, help="omni only: of the sideways speeds tried"
    )
    angular_deviation: float = parameter(
        0.4, "rad/s", above=0.0, help="standard deviation of the turning speeds tried"
    )
    noise_correlation: float = parameter(
        0.8, at_least=0.0, at_most=0.99,
        help="how much of a step's noise carries over to the next; 0 is white noise",
    )  # fmt: skip
    path_spacing: float = parameter(
        0.05, "m", at_least=0.01, at_most=0.5, help="between the path points that critics look at"
    )

    constraint_weight: float = parameter(4.0, at_least=0.0, help="commands beyond the limits")
    constraint_power: int = parameter(1, at_least=1, at_most=4, help="of the constraint critic")
    cost_weight: float = parameter(3.8, at_least=0.0, help="costmap cost under the base")
    cost_power: int = parameter(1, at_least=1, at_most=4, help="of the cost critic")
    collision_cost: float = parameter(
        100.0, above=0.0, help="an immediate collision of the footprint; late ones a fifth of it"
    )
    obstacles_weight: float = parameter(
        30.0, at_least=0.0, help="repulsion by obstacles nearer than `obstacles_margin`"
    )
    obstacles_critical_weight: float = parameter(
        60.0, at_least=0.0, help="repulsion by obstacles nearer than `critical_margin`"
    )
    obstacles_power: int = parameter(1, at_least=1, at_most=4, help="of the obstacles critic")
    obstacles_margin: float = parameter(
        0.2, "m", at_least=0.0, help="clearance round the footprint that is wanted"
    )
    critical_margin: float = parameter(
        0.04, "m", at_least=0.0, help="clearance round the footprint that is hardly given up"
    )
    moving_weight: float = parameter(
        150.0, at_least=0.0, help="repulsion by moving things nearer than `moving_margin`, ever"
    )
    moving_power: int = parameter(1, at_least=1, at_most=4, help="of the moving critic")
    moving_margin: float = parameter(
        0.5, "m", at_least=0.0, help="clearance wanted from where people will be at that time"
    )
    near_goal: float = parameter(
        0.5, "m", at_least=0.0,
        help="way left at which costs and clearance no longer count, only collisions",
    )  # fmt: skip
    goal_weight: float = parameter(5.0, at_least=0.0, help="distance to the goal, near it")
    goal_power: int = parameter(1, at_least=1, at_most=4, help="of the goal critic")
    goal_range: float = parameter(
        1.4, "m", above=0.0, help="way left at which the goal is aimed at, not the path"
    )
    goal_angle_weight: float = parameter(3.0, at_least=0.0, help="heading error near the goal")
    goal_angle_power: int = parameter(1, at_least=1, at_most=4, help="of the goal angle critic")
    goal_angle_range: float = parameter(
        0.5, "m", above=0.0, help="way left at which the goal's heading counts"
    )
    path_align_weight: float = parameter(
        14.0, at_least=0.0, help="distance to the path at equal length driven"
    )
    path_align_power: int = parameter(1, at_least=1, at_most=4, help="of the path align critic")
    path_align_occupied: float = parameter(
        0.07, at_least=0.0, at_most=1.0, help="share of blocked path at which it need not be kept"
    )
    path_angle_weight: float = parameter(
        2.2, at_least=0.0, help="heading off the path when it lies far off ahead"
    )
    path_angle_power: int = parameter(1, at_least=1, at_most=4, help="of the path angle critic")
    path_angle_least: float = parameter(
        0.785, "rad", at_least=0.0, help="path angle applies when the path is farther off than this"
    )
    path_follow_weight: float = parameter(5.0, at_least=0.0, help="way not made along the path")
    path_follow_power: int = parameter(1, at_least=1, at_most=4, help="of the path follow critic")
    path_follow_ahead: float = parameter(
        0.3, "m", at_least=0.0, help="aims this far beyond what the rollouts reach"
    )
    prefer_forward_weight: float = parameter(5.0, at_least=0.0, help="metres driven backward")
    prefer_forward_power: int = parameter(
        1, at_least=1, at_most=4, help="of the prefer forward critic"
    )
    deadband_weight: float = parameter(35.0, at_least=0.0, help="speeds within the dead bands")
    deadband_power: int = parameter(1, at_least=1, at_most=4, help="of the deadband critic")
    linear_deadband: float = parameter(
        0.0, "m/s", at_least=0.0, help="forward speeds below this the drive does not make"
    )
    angular_deadband: float = parameter(
        0.0, "rad/s", at_least=0.0, help="turning speeds below this the drive does not make"
    )
    time_to_collision: float = parameter(
        1.0, "s", above=0.0, help="what is commanded stays clear for this long"
    )
