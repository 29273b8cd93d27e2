"""Critics of the dynamic window controller: each gives every velocity sample a cost.

A critic is a function from a `Sampling` and the parameters to (n,) costs, which are multiplied by
its weight. They follow the critics of Nav2's DWB controller; distances are metres to the polyline
of the path, where Nav2 counts cells of a wavefront.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stack.control.dwb.parameters import DwbParameters
from stack.control.swept import BoolArray
from stack.geometry.costs_under import costs_under
from stack.types import INSCRIBED_COST, LETHAL_COST, CostGrid, FloatArray, Twist

CRITIC_STRIDE = 4
"""Number of steps between the poses whose distance to the path counts."""

CREEPING_SPEED = 0.1
"""Speed in m/s below which a turn counts as a turn in place."""


@dataclass(frozen=True, slots=True)
class Speeds:
    """Velocity samples.

    Attributes:
        linear: (n,) forward, m/s.
        angular: (n,) rad/s.
        lateral: (n,) to the left, m/s.
    """

    linear: FloatArray
    angular: FloatArray
    lateral: FloatArray

    def of(self, keep: BoolArray) -> Speeds:
        """Return the samples selected by a mask (n,)."""
        return Speeds(self.linear[keep], self.angular[keep], self.lateral[keep])

    def twist(self, index: int) -> Twist:
        """Return one sample."""
        return Twist(*(float(axis[index]) for axis in (self.linear, self.angular, self.lateral)))


@dataclass(frozen=True, slots=True)
class Sampling:
    """The samples and the data that the critics use.

    Attributes:
        speeds: final speeds of the samples.
        poses: (n, k, 3) x, y, heading, map frame.
        path: (m, 2) points of the path ahead up to the goal, evenly spaced, map frame.
        onward: (l, 2) the same, extended straight beyond the goal.
        spacing: metres between the points.
        costs: the local costmap.
        near_goal: the goal is within reach: only its position counts, not the path beyond it or
            the costs around it. Never for a car: its final heading depends on how it arrives.
    """

    speeds: Speeds
    poses: FloatArray
    path: FloatArray
    onward: FloatArray
    spacing: float
    costs: CostGrid
    near_goal: bool

    def ends(self, forward: float = 0.0) -> FloatArray:
        """(n, 2) end points of the motions, or points `forward` metres ahead of the robot there."""
        last = self.poses[:, -1]
        return last[:, :2] + forward * np.column_stack([np.cos(last[:, 2]), np.sin(last[:, 2])])


def to_path(path: FloatArray, spacing: float, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Distance of points (n, 2) to a path (m, 2), and remaining path from there; both (n,), m."""
    squares = np.square(points[:, None, 0] - path[:, 0])
    squares += np.square(points[:, None, 1] - path[:, 1])
    nearest = np.argmin(squares, axis=1)
    distance = np.sqrt(squares[np.arange(len(points)), nearest])
    return distance, spacing * (len(path) - 1.0 - nearest)


def path_distance(sampling: Sampling, p: DwbParameters) -> FloatArray:
    """Mean distance to the path; the end alone (Nav2's default) would let the robot cut corners."""
    places = sampling.poses[:, ::-CRITIC_STRIDE, :2]
    distance, _ = to_path(sampling.path, sampling.spacing, places.reshape(-1, 2))
    mean: FloatArray = distance.reshape(places.shape[:2]).mean(axis=1)
    return mean


def goal_distance(sampling: Sampling, p: DwbParameters) -> FloatArray:
    """Remaining path after a motion, metres; near the goal the distance to the goal."""
    if sampling.near_goal:
        offset = sampling.ends() - sampling.path[-1]
        away: FloatArray = np.hypot(offset[:, 0], offset[:, 1])
        return away
    distance, left = to_path(sampling.path, sampling.spacing, sampling.ends())
    return np.where(left > 0.0, left, distance)


def path_align(sampling: Sampling, p: DwbParameters) -> FloatArray:
    """Distance to the path of a point ahead of the robot at the end: aligns it with the path."""
    points = sampling.ends(p.forward_point)
    return to_path(sampling.onward, sampling.spacing, points)[0]


def goal_align(sampling: Sampling, p: DwbParameters) -> FloatArray:
    """Remaining path from a point ahead of the robot at the end: turns it along the path."""
    points = sampling.ends(p.forward_point)
    return to_path(sampling.onward, sampling.spacing, points)[1]


def obstacle(sampling: Sampling, p: DwbParameters) -> FloatArray:
    """Highest passable cost under the base during the motion, as a share of 252."""
    count, steps, _ = sampling.poses.shape
    under = costs_under(sampling.costs, sampling.poses.reshape(-1, 3)).astype(float)
    under[under > LETHAL_COST] = 0.0
    highest = INSCRIBED_COST - 1
    worst: FloatArray = np.minimum(under, highest).reshape(count, steps).max(axis=1) / highest
    return worst


def prefer_forward(sampling: Sampling, p: DwbParameters) -> FloatArray:
    """1 for driving backward, up to 1 for turning in place."""
    speeds = sampling.speeds
    slow = np.clip(1.0 - np.hypot(speeds.linear, speeds.lateral) / CREEPING_SPEED, 0.0, 1.0)
    twist = np.abs(speeds.angular) / p.turn_speed
    return np.where(speeds.linear < 0.0, 1.0, slow * twist)


def twirling(sampling: Sampling, p: DwbParameters) -> FloatArray:
    """Absolute turning speed, rad/s."""
    return np.abs(sampling.speeds.angular)


FAR_FROM_GOAL = frozenset({path_distance, path_align, goal_align, obstacle})
"""Critics that are not used near the goal."""


def total_cost(sampling: Sampling, p: DwbParameters) -> FloatArray:
    """Return the weighted sum of all critics, (n,)."""
    critics = (
        (p.path_distance_weight, path_distance),
        (p.goal_distance_weight, goal_distance),
        (p.path_align_weight, path_align),
        (p.goal_align_weight, goal_align),
        (p.obstacle_weight, obstacle),
        (p.prefer_forward_weight, prefer_forward),
        (p.twirling_weight, twirling),
    )
    total = np.zeros(len(sampling.poses))
    for weight, critic in critics:
        if weight and not (sampling.near_goal and critic in FAR_FROM_GOAL):
            total += weight * critic(sampling, p)
    return total
