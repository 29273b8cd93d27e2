"""The critics: what makes one rollout better than another.

Each is a function that adds its cost to every rollout's, or leaves it be where it does not apply.
They follow the critics of Nav2's MPPI controller (S. Macenski et al., 2023), with two differences.
A collision costs more the sooner it comes, as the robot may still stop before a late one. And the
goal critics go by the way left along the path, so that a goal behind a wall attracts nobody.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2
from typing import Any

import numpy as np

from stack.control.mppi.parameters import MppiParameters
from stack.control.mppi.scene import Array32, LocalPath, Obstacles, Outline, Rollouts
from stack.drivetrain.description import DriveKind
from stack.types import wrap_angle

ALIGN_STRIDE = 4
"""Steps from one comparison of path and rollout to the next."""

OUTLINE_EVERY = 2.0
"""Cells that a rollout may move on before its outline is looked at again."""

LATE_COLLISION = 0.2
"""Share of the collision cost that a collision at the end of the horizon has."""

STRAIGHT_ENOUGH = 0.6
"""Straight-line distance over way left above which a goal may be made for directly."""


@dataclass(frozen=True, slots=True)
class Judgement:
    """What the critics judge by.

    Attributes:
        kernels: the module with the compiled loops.
        path: to follow.
        plan: (axes, steps) that the rollouts vary.
        pull: (axes, steps) the plan times the inverse covariance of the noise.
        heading: of the robot, map frame.
        furthest: index of the path point that the rollouts reach.
        drive: how the robot can move.
        moving: whether anything around it does.
    """

    kernels: Any
    parameters: MppiParameters
    path: LocalPath
    plan: Array32
    pull: Array32
    heading: float
    furthest: int
    drive: DriveKind = DriveKind.DIFFERENTIAL
    moving: bool = False

    def add(self, rollouts: Rollouts, term: Array32, weight: float, power: int) -> None:
        """Add (weight × term) ** power to the rollouts' costs."""
        self.kernels.add(rollouts.costs, term, weight, power)

    @property
    def near_goal(self) -> bool:
        """Whether the goal itself is made for."""
        path = self.path
        near = path.remaining <= self.parameters.goal_range
        return near and path.goal_distance >= STRAIGHT_ENOUGH * path.remaining


def look_around(
    kernels: Any, p: MppiParameters, rollouts: Rollouts, obstacles: Obstacles, body: Outline
) -> None:
    """Find what each rollout meets; the cost and obstacles critics read it."""
    ratio = p.obstacles_critical_weight / p.obstacles_weight if p.obstacles_weight else 0.0
    margins = np.array([p.obstacles_margin, p.critical_margin, ratio], np.float32)
    step = max(p.cruise_speed * p.time_step, 1e-3)
    stride = max(1, int(OUTLINE_EVERY * float(obstacles.geometry[3]) / step))
    kernels.near_obstacles(
        rollouts.poses, obstacles.cells, obstacles.distance, obstacles.lethal,
        obstacles.geometry, body.discs, body.core, body.points, stride, margins,
        rollouts.obstacle_cost, rollouts.repulsion, rollouts.hits,
    )  # fmt: skip
    if len(obstacles.moving):
        kernels.near_moving(
            rollouts.poses, obstacles.moving, body.discs, p.moving_margin, p.time_step,
            rollouts.closeness, rollouts.hits,
        )  # fmt: skip


def constraint(j: Judgement, rollouts: Rollouts) -> None:
    """Commands beyond what the robot can do, integrated over the horizon."""
    p = j.parameters
    weight = p.constraint_weight * p.time_step
    j.add(rollouts, rollouts.excess, weight, p.constraint_power)


def cost(j: Judgement, rollouts: Rollouts) -> None:
    """Costmap cost under the base; collisions of the footprint, sooner ones more."""
    p = j.parameters
    if j.path.remaining > p.near_goal:
        j.add(rollouts, rollouts.obstacle_cost, p.cost_weight, p.cost_power)
    steps = rollouts.poses.shape[1]
    late = rollouts.hits / steps
    price = np.where(late < 1.0, 1.0 - (1.0 - LATE_COLLISION) * late, 0.0)
    j.add(rollouts, price.astype(np.float32), p.collision_cost, 1)


def obstacles(j: Judgement, rollouts: Rollouts) -> None:
    """Clearance of the footprint below the margins."""
    p = j.parameters
    if j.path.remaining > p.near_goal:
        j.add(rollouts, rollouts.repulsion, p.obstacles_weight, p.obstacles_power)


def moving(j: Judgement, rollouts: Rollouts) -> None:
    """Clearance below the margin from where moving things will be when a rollout comes by.

    They are believed to keep their velocities (Schöller et al., "What the constant velocity model
    can teach us about pedestrian motion prediction", RA-L 2020).
    """
    if j.moving:
        p = j.parameters
        j.add(rollouts, rollouts.closeness, p.moving_weight, p.moving_power)


def goal(j: Judgement, rollouts: Rollouts) -> None:
    """Mean distance to the goal, near it."""
    p = j.parameters
    if p.goal_weight and j.near_goal:
        j.kernels.mean_distance(rollouts.poses, j.path.goal.x, j.path.goal.y, rollouts.term)
        j.add(rollouts, rollouts.term, p.goal_weight, p.goal_power)


def goal_angle(j: Judgement, rollouts: Rollouts) -> None:
    """Mean angle to the goal's heading, close to it.

    Not for a differential drive: it cannot come nearer to a goal while it faces elsewhere, and
    turns in place once it is there.
    """
    p = j.parameters
    if j.drive is DriveKind.DIFFERENTIAL:
        return
    if p.goal_angle_weight and j.path.remaining <= p.goal_angle_range:
        j.kernels.mean_turn(rollouts.poses, j.path.goal.heading, rollouts.term)
        j.add(rollouts, rollouts.term, p.goal_angle_weight, p.goal_angle_power)


def path_align(j: Judgement, rollouts: Rollouts) -> None:
    """Distance to the path at equal length driven, unless the path is blocked."""
    p, path = j.parameters, j.path
    if not p.path_align_weight or j.furthest == 0 or j.near_goal:
        return
    blocked = 1.0 - float(np.mean(path.open[: j.furthest + 1]))
    if blocked > p.path_align_occupied:
        return
    j.kernels.path_alignment(
        rollouts.poses, rollouts.velocities, path.points, path.spacing, p.time_step, j.furthest,
        ALIGN_STRIDE, rollouts.term,
    )  # fmt: skip
    j.add(rollouts, rollouts.term, p.path_align_weight, p.path_align_power)


def path_angle(j: Judgement, rollouts: Rollouts) -> None:
    """Heading off the path at the end, when the path ahead lies far to the side."""
    p = j.parameters
    if not p.path_angle_weight or j.near_goal:
        return
    x, y = aim(j)
    if abs(wrap_angle(atan2(y, x) - j.heading)) < p.path_angle_least:
        return
    j.kernels.end_bearing(rollouts.poses, x, y, rollouts.term)
    j.add(rollouts, rollouts.term, p.path_angle_weight, p.path_angle_power)


def path_follow(j: Judgement, rollouts: Rollouts) -> None:
    """Distance from the end to a path point a little beyond what is reached."""
    p = j.parameters
    if p.path_follow_weight and not j.near_goal:
        j.kernels.end_distance(rollouts.poses, *aim(j), rollouts.term)
        j.add(rollouts, rollouts.term, p.path_follow_weight, p.path_follow_power)


def aim(j: Judgement) -> tuple[float, float]:
    """The first open path point `path_follow_ahead` beyond the furthest reached, robot's axes."""
    path = j.path
    index = j.furthest + round(j.parameters.path_follow_ahead / path.spacing)
    index = min(index, len(path.points) - 1)
    beyond = np.flatnonzero(path.open[index:])
    x, y = path.points[index + (int(beyond[0]) if len(beyond) else 0)]
    return float(x), float(y)


def prefer_forward(j: Judgement, rollouts: Rollouts) -> None:
    """Metres driven backward."""
    p = j.parameters
    if p.prefer_forward_weight and p.reverse_speed:
        j.kernels.driven_backward(rollouts.velocities, p.time_step, rollouts.term)
        j.add(rollouts, rollouts.term, p.prefer_forward_weight, p.prefer_forward_power)


def deadband(j: Judgement, rollouts: Rollouts) -> None:
    """Speeds that the drive does not make."""
    p = j.parameters
    if p.deadband_weight and (p.linear_deadband or p.angular_deadband):
        bands = [p.linear_deadband, p.angular_deadband, p.linear_deadband]
        axes = len(rollouts.velocities)
        j.kernels.within_deadband(
            rollouts.velocities, np.array(bands[:axes], np.float32), p.time_step, rollouts.term
        )
        j.add(rollouts, rollouts.term, p.deadband_weight, p.deadband_power)


def liveliness(j: Judgement, rollouts: Rollouts) -> None:
    """The information-theoretic price of leaving the last plan."""
    if j.parameters.gamma:
        j.kernels.price_of_noise(rollouts.controls, j.plan, j.pull, rollouts.term)
        j.add(rollouts, rollouts.term, j.parameters.gamma, 1)


CRITICS = (
    constraint, cost, obstacles, moving, goal, goal_angle, path_align, path_angle, path_follow,
    prefer_forward, deadband, liveliness,
)  # fmt: skip
