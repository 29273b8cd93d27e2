"""Input of one MPPI command (obstacles, outline, path and goal), and the arrays of the rollouts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, hypot

import numpy as np
from numpy.typing import NDArray

from stack.geometry.costs_under import costs_under
from stack.geometry.distance_transform import distances_to_zero
from stack.geometry.path_segment import PathSegment
from stack.geometry.polygons import fill_polygon, outline_points
from stack.types import (
    INSCRIBED_COST,
    LETHAL_COST,
    CostGrid,
    FloatArray,
    Footprint,
    Pose2D,
    TrackedObject,
)

Array32 = NDArray[np.float32]

NO_OBSTACLE = 1e6
"""Distance in metres when the grid has no lethal cell."""


MOST_CORE = 12
"""Maximum number of discs inside a footprint."""


@dataclass(frozen=True, slots=True)
class Obstacles:
    """Costmap and moving objects, as arrays for the kernels.

    Attributes:
        cells: (rows, columns) uint8 costs.
        distance: (rows, columns) float32 metres to the nearest lethal cell; cells that the
            footprint covers already do not count.
        lethal: (rows + 2, columns + 2) int32, 1 where the distance is 0, with a free border.
        geometry: (4,) float32: x and y of the grid's outer corner relative to the robot, cells per
            metre, metres per cell.
        moving: (k, 5) float32 of moving objects: x, y relative to the robot in axes parallel to
            the map's, velocity along both, radius.
        covers: whether the footprint covers lethal cells.
    """

    cells: NDArray[np.uint8]
    distance: Array32
    lethal: NDArray[np.int32]
    geometry: Array32
    moving: Array32
    covers: bool = False

    @staticmethod
    def of(
        costs: CostGrid, pose: Pose2D, body: FloatArray, tracks: Sequence[TrackedObject] = (),
        before: Obstacles | None = None,
    ) -> Obstacles:  # fmt: skip
        """Create from a costmap around a pose.

        Args:
            costs: local costmap, map frame.
            pose: of the robot, map frame.
            body: (m, 2) points that fill the footprint, base frame, metres.
            tracks: moving objects at the current time, map frame.
            before: those of the last command; distances in the same grid are taken from there.
        """
        cells = costs.cells
        covered = pose.transform(body)
        columns, rows = (
            np.floor((covered[:, k] - costs.origin[k]) / costs.resolution).astype(int)
            for k in (0, 1)
        )
        inside = (rows >= 0) & (rows < cells.shape[0]) & (columns >= 0) & (columns < cells.shape[1])
        rows, columns = rows[inside], columns[inside]
        covers = bool((cells[rows, columns] == LETHAL_COST).any())
        if before is not None and before.cells is cells and not (covers or before.covers):
            distance, lethal = before.distance, before.lethal
        else:
            free = (cells != LETHAL_COST).view(np.uint8)
            free[rows, columns] = 1
            distance, lethal = _distances(free, costs.resolution)
        x, y = costs.origin
        geometry = [x - pose.x, y - pose.y, 1.0 / costs.resolution, costs.resolution]
        moving = [
            (track.position[0] - pose.x, track.position[1] - pose.y, *track.velocity, track.radius)
            for track in tracks
        ]
        return Obstacles(
            cells, distance, lethal, np.array(geometry, np.float32),
            np.array(moving, np.float32).reshape(-1, 5), covers,
        )  # fmt: skip


def _distances(free: NDArray[np.uint8], resolution: float) -> tuple[Array32, NDArray[np.int32]]:
    """Return `distance` and `lethal` of `Obstacles` for cells that are 0 where they are lethal."""
    if free.all():
        distance = np.full(free.shape, NO_OBSTACLE, np.float32)
    else:
        distance = distances_to_zero(free) * np.float32(resolution)
    lethal = np.zeros((free.shape[0] + 2, free.shape[1] + 2), np.int32)
    lethal[1:-1, 1:-1] = free == 0
    return distance, lethal


@dataclass(frozen=True, slots=True)
class BodyArrays:
    """Footprint, as arrays for the kernels; base frame, metres.

    Attributes:
        discs: (k, 3) float32 x, y, radius; together they cover the footprint.
        core: (l, 3) float32 x, y, radius of discs inside it: a lethal cell nearer to a centre than
            the radius is inside the footprint.
        points: (2, m) float32 x and y along its edge.
    """

    discs: Array32
    core: Array32
    points: Array32

    @staticmethod
    def of(footprint: Footprint, resolution: float) -> BodyArrays:
        """Create discs in a row along the longer side, and edge points at most 0.7 cells apart."""
        corners = footprint.points
        low, high = corners.min(axis=0), corners.max(axis=0)
        axis = int(np.argmax(high - low))
        length, width = high[axis] - low[axis], high[1 - axis] - low[1 - axis]
        round_enough = footprint.circumscribed_radius < 1.1 * footprint.inscribed_radius
        count = 1 if round_enough else min(6, ceil(2.0 * length / width))
        filled = fill_polygon(footprint.points, 0.1 * width)
        discs = []
        for n in range(count):
            begin, end = (low[axis] + length * share / count for share in (n, n + 1))
            slack = 0.1 * width + 1e-9
            part = filled[(filled[:, axis] >= begin - slack) & (filled[:, axis] <= end + slack)]
            part = np.column_stack([np.clip(part[:, axis], begin, end), part[:, 1 - axis]])
            middle = np.array([(begin + end) / 2, (part[:, 1].min() + part[:, 1].max()) / 2])
            radius = float(np.linalg.norm(part - middle, axis=1).max())
            discs.append((*(middle if axis == 0 else middle[::-1]), radius))
        points = outline_points(footprint.points, 0.7 * resolution).T
        return BodyArrays(
            np.array(discs, np.float32),
            _core(footprint, filled, resolution),
            np.ascontiguousarray(points, np.float32),
        )


def clearance_to(
    outline: BodyArrays, poses: FloatArray, times: FloatArray, track: TrackedObject
) -> FloatArray:
    """Return the (k,) clearances in metres to an object at constant velocity; below 0: contact.

    Args:
        outline: of the robot.
        poses: (k, 3) x, y, heading, map frame.
        times: (k,) seconds since the time of the track.
        track: the moving object, at the current time.
    """
    c, s = np.cos(poses[:, 2, None]), np.sin(poses[:, 2, None])
    x, y, radius = outline.discs.T.astype(np.float64)
    away_x = poses[:, :1] + c * x - s * y - track.position[0] - times[:, None] * track.velocity[0]
    away_y = poses[:, 1:2] + s * x + c * y - track.position[1] - times[:, None] * track.velocity[1]
    room: FloatArray = (np.hypot(away_x, away_y) - radius).min(axis=1) - track.radius
    return room


def _core(footprint: Footprint, filled: FloatArray, resolution: float) -> Array32:
    """(l, 3) discs inside a footprint, each as large as possible, chosen greedily.

    Positions are rounded to cells, so each radius is reduced by half a cell's diagonal.
    """
    edge = outline_points(footprint.points, 0.01)
    room = np.linalg.norm(filled[:, None] - edge, axis=2).min(axis=1)
    discs: list[tuple[float, float, float]] = []
    left = np.ones(len(filled), dtype=bool)
    while left.any() and len(discs) < MOST_CORE:
        best = int(np.argmax(np.where(left, room, -1.0)))
        if room[best] < 1.5 * resolution:
            break
        x, y = filled[best]
        discs.append((x, y, room[best] - 0.71 * resolution))
        left &= np.linalg.norm(filled - filled[best], axis=1) > 0.6 * room[best]
    return np.array(discs, np.float32).reshape(-1, 3)


@dataclass(frozen=True, slots=True)
class LocalPath:
    """The path ahead, in axes parallel to the map's with the robot at the origin.

    Attributes:
        points: (n, 2) float32, evenly spaced except for the last; the nearest to the robot first.
        open: (n,) whether the base can be there without a collision.
        spacing: metres between points.
        goal: end of the path; heading in the map frame.
        remaining: metres to the goal along the path.
    """

    points: Array32
    open: NDArray[np.bool_]
    spacing: float
    goal: Pose2D
    remaining: float

    @staticmethod
    def of(
        segment: PathSegment, pose: Pose2D, costs: CostGrid, reach: float, spacing: float
    ) -> LocalPath:
        """Create from the next `reach` metres of a path."""
        points = segment.sampled(reach, spacing)
        under = costs_under(costs, points)
        free = (under < INSCRIBED_COST) | (under > LETHAL_COST)
        goal = segment.arrival
        return LocalPath(
            np.ascontiguousarray(points - (pose.x, pose.y), dtype=np.float32), free, spacing,
            Pose2D(goal.x - pose.x, goal.y - pose.y, goal.heading), segment.remaining,
        )  # fmt: skip

    @property
    def goal_distance(self) -> float:
        """Straight-line distance from the robot to the goal, metres."""
        return hypot(self.goal.x, self.goal.y)


class Rollouts:
    """Arrays of one batch of rollouts, float32, shapes as in the kernels.

    Attributes:
        controls: (axes, steps, batch) sampled speeds.
        velocities: (axes, steps, batch) speeds after the limits of the drive.
        poses: (5, steps, batch) x, y, heading, its cosine and sine.
        excess: (batch,) sum of the controls' excess over the limits.
        hits: (batch,) int64 step of the first collision; the number of steps: none.
        obstacle_cost: (batch,) mean cost under the base.
        repulsion: (batch,) mean violation of the desired clearance, metres.
        closeness: (batch,) mean violation of the clearance to moving objects, metres.
        costs: (batch,) total costs.
        term: (batch,) term of the current critic.
    """

    def __init__(self, axes: int, steps: int, batch: int) -> None:
        self.controls = np.zeros((axes, steps, batch), np.float32)
        self.velocities = np.zeros((axes, steps, batch), np.float32)
        self.poses = np.zeros((5, steps, batch), np.float32)
        self.excess, self.obstacle_cost, self.repulsion = np.zeros((3, batch), np.float32)
        self.closeness, self.costs, self.term = np.zeros((3, batch), np.float32)
        self.hits = np.zeros(batch, np.int64)
