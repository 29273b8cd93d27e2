"""Critics of the MPPI controller: each adds a cost to every rollout.

They follow the critics of Nav2's MPPI controller (S. Macenski et al., 2023), with two differences.
An early collision costs more than a late one, before which the robot may still stop. The goal
critics use the remaining length of the path, so that a goal behind a wall does not attract the
robot.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2
from typing import Any

import numpy as np

from stack.control.mppi.parameters import MppiParameters
from stack.control.mppi.scene import Array32, BodyArrays, LocalPath, Obstacles, Rollouts
from stack.types import wrap_angle

COLLISION_COST = 100.0
"""Cost of an immediate collision: more than all other critics together."""
OBSTACLES_CRITICAL_WEIGHT = 60.0
"""Weight of obstacles nearer than critical_margin: twice that of near ones."""
PATH_FOLLOW_AHEAD = 0.3
"""Distance of the point that path follow aims at beyond the reach of the rollouts, m."""

ALIGN_STRIDE = 4
"""Number of steps between two comparisons of path and rollout."""

OUTLINE_EVERY = 2.0
"""Number of cells that a rollout may move between two checks of its outline."""

LATE_COLLISION = 0.2
"""Cost of a collision at the end of the horizon, as a share of the collision cost."""

STRAIGHT_ENOUGH = 0.6
"""Minimum ratio of straight-line distance to remaining path at which the goal critics apply."""


@dataclass(frozen=True, slots=True)
class CriticData:
    """Input of the critics.

    Attributes:
        kernels: the module with the compiled loops.
        path: to follow.
        plan: (axes, steps) mean of the sampled controls.
        pull: (axes, steps) the plan times the inverse covariance of the noise.
        heading: of the robot, map frame, radians.
        furthest: index of the furthest path point that the rollouts reach.
        aligns_in_place: whether the robot turns to the goal's heading in place, at the goal.
        moving: whether there are moving objects around the robot.
    """

    kernels: Any
    parameters: MppiParameters
    path: LocalPath
    plan: Array32
    pull: Array32
    heading: float
    furthest: int
    aligns_in_place: bool = True
    moving: bool = False

    def add(self, rollouts: Rollouts, term: Array32, weight: float, power: int) -> None:
        """Add (weight × term) ** power to the rollouts' costs."""
        self.kernels.add(rollouts.costs, term, weight, power)

    @property
    def near_goal(self) -> bool:
        """Whether the goal critics replace the path critics."""
        path = self.path
        near = path.remaining <= self.parameters.goal_range
        return near and path.goal_distance >= STRAIGHT_ENOUGH * path.remaining


def evaluate_obstacles(
    kernels: Any, p: MppiParameters, rollouts: Rollouts, obstacles: Obstacles, body: BodyArrays
) -> None:
    """Compute costs, clearances and collisions of each rollout, for the obstacle critics."""
    ratio = OBSTACLES_CRITICAL_WEIGHT / p.obstacles_weight if p.obstacles_weight else 0.0
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


def constraint(data: CriticData, rollouts: Rollouts) -> None:
    """Commands beyond the robot's limits, integrated over the horizon."""
    p = data.parameters
    weight = p.constraint_weight * p.time_step
    data.add(rollouts, rollouts.excess, weight, p.constraint_power)


def cost(data: CriticData, rollouts: Rollouts) -> None:
    """Costmap cost under the base, and collisions of the footprint; early ones cost more."""
    p = data.parameters
    if data.path.remaining > p.near_goal:
        data.add(rollouts, rollouts.obstacle_cost, p.cost_weight, p.cost_power)
    steps = rollouts.poses.shape[1]
    late = rollouts.hits / steps
    price = np.where(late < 1.0, 1.0 - (1.0 - LATE_COLLISION) * late, 0.0)
    data.add(rollouts, price.astype(np.float32), COLLISION_COST, 1)


def obstacles(data: CriticData, rollouts: Rollouts) -> None:
    """Violation of the desired clearance around the footprint."""
    p = data.parameters
    if data.path.remaining > p.near_goal:
        data.add(rollouts, rollouts.repulsion, p.obstacles_weight, p.obstacles_power)


def moving(data: CriticData, rollouts: Rollouts) -> None:
    """Violation of the desired clearance to the predicted positions of moving objects.

    The prediction assumes constant velocity (Schöller et al., "What the constant velocity model
    can teach us about pedestrian motion prediction", RA-L 2020).
    """
    if data.moving:
        p = data.parameters
        data.add(rollouts, rollouts.closeness, p.moving_weight, 1)


def goal(data: CriticData, rollouts: Rollouts) -> None:
    """Mean distance to the goal; applies near the goal."""
    p = data.parameters
    if p.goal_weight and data.near_goal:
        data.kernels.mean_distance(
            rollouts.poses, data.path.goal.x, data.path.goal.y, rollouts.term
        )
        data.add(rollouts, rollouts.term, p.goal_weight, p.goal_power)


def goal_angle(data: CriticData, rollouts: Rollouts) -> None:
    """Mean angle to the goal's heading; applies close to the goal.

    Not for a robot that aligns in place: it cannot approach the goal with another heading than that
    of its motion.
    """
    p = data.parameters
    if data.aligns_in_place:
        return
    if p.goal_angle_weight and data.path.remaining <= p.goal_angle_range:
        data.kernels.mean_turn(rollouts.poses, data.path.goal.heading, rollouts.term)
        data.add(rollouts, rollouts.term, p.goal_angle_weight, p.goal_angle_power)


def path_align(data: CriticData, rollouts: Rollouts) -> None:
    """Distance to the path at equal length driven, unless the path is blocked."""
    p, path = data.parameters, data.path
    if not p.path_align_weight or data.furthest == 0 or data.near_goal:
        return
    blocked = 1.0 - float(np.mean(path.open[: data.furthest + 1]))
    if blocked > p.path_align_occupied:
        return
    data.kernels.path_alignment(
        rollouts.poses, rollouts.velocities, path.points, path.spacing, p.time_step, data.furthest,
        ALIGN_STRIDE, rollouts.term,
    )  # fmt: skip
    data.add(rollouts, rollouts.term, p.path_align_weight, p.path_align_power)


def path_angle(data: CriticData, rollouts: Rollouts) -> None:
    """Angle to the path ahead at the end of a rollout, when the robot faces away from the path."""
    p = data.parameters
    if not p.path_angle_weight or data.near_goal:
        return
    x, y = aim(data)
    if abs(wrap_angle(atan2(y, x) - data.heading)) < p.path_angle_least:
        return
    data.kernels.end_bearing(rollouts.poses, x, y, rollouts.term)
    data.add(rollouts, rollouts.term, p.path_angle_weight, p.path_angle_power)


def path_follow(data: CriticData, rollouts: Rollouts) -> None:
    """Distance from the end to a path point slightly beyond the furthest reached one."""
    p = data.parameters
    if p.path_follow_weight and not data.near_goal:
        x, y = np.array(aim(data), np.float32)
        dx, dy = rollouts.poses[0, -1] - x, rollouts.poses[1, -1] - y
        np.sqrt(dx * dx + dy * dy, out=rollouts.term)
        data.add(rollouts, rollouts.term, p.path_follow_weight, p.path_follow_power)


def aim(data: CriticData) -> tuple[float, float]:
    """First free path point at least PATH_FOLLOW_AHEAD beyond the furthest reached one (x, y)."""
    path = data.path
    index = data.furthest + round(PATH_FOLLOW_AHEAD / path.spacing)
    index = min(index, len(path.points) - 1)
    beyond = np.flatnonzero(path.open[index:])
    x, y = path.points[index + (int(beyond[0]) if len(beyond) else 0)]
    return float(x), float(y)


def prefer_forward(data: CriticData, rollouts: Rollouts) -> None:
    """Distance driven backward, metres."""
    p = data.parameters
    if p.prefer_forward_weight and p.reverse_speed:
        backward = np.maximum(-rollouts.velocities[0], np.float32(0.0))
        np.sum(backward * np.float32(p.time_step), axis=0, out=rollouts.term)
        data.add(rollouts, rollouts.term, p.prefer_forward_weight, p.prefer_forward_power)


def control_cost(data: CriticData, rollouts: Rollouts) -> None:
    """Information-theoretic cost of deviations from the last plan."""
    if data.parameters.gamma:
        data.kernels.noise_cost(rollouts.controls, data.plan, data.pull, rollouts.term)
        data.add(rollouts, rollouts.term, data.parameters.gamma, 1)


CRITICS = (
    constraint, cost, obstacles, moving, goal, goal_angle, path_align, path_angle, path_follow,
    prefer_forward, control_cost,
)  # fmt: skip
