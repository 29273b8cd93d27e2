"""The critics: what makes one pair of speeds better than another.

Each is a function from a `Sampling` and the parameters to (n,) costs, to be multiplied by its
weight. They follow the critics of Nav2's DWB controller; distances are metres to the polyline of
the path where Nav2 counts cells of a wave front.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from stack.control.dwb.parameters import DwbParameters
from stack.control.swept import BoolArray
from stack.types import CostGrid, FloatArray, Twist

HIGHEST_PASSABLE, LETHAL = 252, 254

PLACES = 4
"""Steps from one place on a motion to the next whose distance to the path counts."""

CREEPING = 0.1
"""m/s below which a turn counts as twisting on the spot."""


@dataclass(frozen=True, slots=True)
class Speeds:
    """Speeds tried.

    Attributes:
        linear: (n,) forward, m/s.
        angular: (n,) rad/s.
        lateral: (n,) to the left, m/s.
    """

    linear: FloatArray
    angular: FloatArray
    lateral: FloatArray

    def of(self, keep: BoolArray) -> Speeds:
        """Those of them that are marked (n,)."""
        return Speeds(self.linear[keep], self.angular[keep], self.lateral[keep])

    def twist(self, index: int) -> Twist:
        """One of them."""
        return Twist(*(float(axis[index]) for axis in (self.linear, self.angular, self.lateral)))


@dataclass(frozen=True, slots=True)
class Sampling:
    """What was tried and what there is.

    Attributes:
        speeds: in the end.
        poses: (n, k, 3) x, y, heading, map frame.
        path: (m, 2) points of the path ahead up to the goal, evenly spaced, map frame.
        onward: (l, 2) likewise, and farther, straight on beyond the goal.
        spacing: metres between them.
        costs: the local costmap.
        near_goal: the goal is within reach: its position counts, not the way on, and costs round it
            have to be borne. Never for a car: how it arrives is its heading there.
    """

    speeds: Speeds
    poses: FloatArray
    path: FloatArray
    onward: FloatArray
    spacing: float
    costs: CostGrid
    near_goal: bool

    def ends(self, forward: float = 0.0) -> FloatArray:
        """(n, 2) where each motion ends, or a point so many metres before the robot then."""
        last = self.poses[:, -1]
        return last[:, :2] + forward * np.column_stack([np.cos(last[:, 2]), np.sin(last[:, 2])])


def to_path(path: FloatArray, spacing: float, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Distance of points (n, 2) to a path (m, 2), and the way left on it from there, both (n,)."""
    squares = np.square(points[:, None, 0] - path[:, 0])
    squares += np.square(points[:, None, 1] - path[:, 1])
    nearest = np.argmin(squares, axis=1)
    distance = np.sqrt(squares[np.arange(len(points)), nearest])
    return distance, spacing * (len(path) - 1.0 - nearest)


def path_distance(sampling: Sampling, p: DwbParameters) -> FloatArray:
    """Mean distance to the path: at the end alone (Nav2's default) it would cut corners."""
    places = sampling.poses[:, ::-PLACES, :2]
    distance, _ = to_path(sampling.path, sampling.spacing, places.reshape(-1, 2))
    mean: FloatArray = distance.reshape(places.shape[:2]).mean(axis=1)
    return mean


def goal_distance(sampling: Sampling, p: DwbParameters) -> FloatArray:
    """How much of the path ahead a motion leaves; near the goal the distance to it."""
    if sampling.near_goal:
        offset = sampling.ends() - sampling.path[-1]
        away: FloatArray = np.hypot(offset[:, 0], offset[:, 1])
        return away
    distance, left = to_path(sampling.path, sampling.spacing, sampling.ends())
    return np.where(left > 0.0, left, distance)


def path_align(sampling: Sampling, p: DwbParameters) -> FloatArray:
    """How far from the path a point before the robot ends: turns the robot along it."""
    points = sampling.ends(p.forward_point)
    return to_path(sampling.onward, sampling.spacing, points)[0]


def goal_align(sampling: Sampling, p: DwbParameters) -> FloatArray:
    """How much of the path a point before the robot leaves: turns the robot onward."""
    points = sampling.ends(p.forward_point)
    return to_path(sampling.onward, sampling.spacing, points)[1]


def obstacle(sampling: Sampling, p: DwbParameters) -> FloatArray:
    """The highest passable cost under the base on the way, as a share of 252."""
    costs, poses = sampling.costs, sampling.poses
    columns, rows = (
        np.floor((poses[..., k] - costs.origin[k]) / costs.resolution).astype(int) for k in (0, 1)
    )
    inside = (rows >= 0) & (rows < costs.cells.shape[0])
    inside &= (columns >= 0) & (columns < costs.cells.shape[1])
    found = costs.cells[np.where(inside, rows, 0), np.where(inside, columns, 0)].astype(float)
    found[~inside | (found > LETHAL)] = 0.0
    worst: FloatArray = np.minimum(found, HIGHEST_PASSABLE).max(axis=1) / HIGHEST_PASSABLE
    return worst


def prefer_forward(sampling: Sampling, p: DwbParameters) -> FloatArray:
    """1 for driving backward, and up to 1 for turning on the spot."""
    speeds = sampling.speeds
    slow = np.clip(1.0 - np.hypot(speeds.linear, speeds.lateral) / CREEPING, 0.0, 1.0)
    twist = np.abs(speeds.angular) / p.turn_speed
    return np.where(speeds.linear < 0.0, 1.0, slow * twist)


def twirling(sampling: Sampling, p: DwbParameters) -> FloatArray:
    """The turning speed."""
    return np.abs(sampling.speeds.angular)


Critic = Callable[[Sampling, DwbParameters], FloatArray]

CRITICS: dict[str, Critic] = {
    "path_distance": path_distance,
    "goal_distance": goal_distance,
    "path_align": path_align,
    "goal_align": goal_align,
    "obstacle": obstacle,
    "prefer_forward": prefer_forward,
    "twirling": twirling,
}


FAR_FROM_GOAL = frozenset({"path_distance", "path_align", "goal_align", "obstacle"})
"""Critics that are left out near the goal."""


def judge(sampling: Sampling, p: DwbParameters) -> FloatArray:
    """(n,) the weighted sum of all critics."""
    total = np.zeros(len(sampling.poses))
    for name, critic in CRITICS.items():
        weight = getattr(p, f"{name}_weight")
        if weight and not (sampling.near_goal and name in FAR_FROM_GOAL):
            total += weight * critic(sampling, p)
    return total
