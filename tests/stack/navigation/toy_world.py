"""A kinematic world in numpy: square rooms, round people, a lidar, a robot. No physics.

The robot moves as its drive can: sideways only an omnidirectional one, and a car on arcs.

Full drives run in milliseconds, so that hundreds of them fit into a test run.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import atan2, cos, hypot, pi, sin, sqrt
from pathlib import Path as FilePath
from typing import ClassVar

import cv2
import numpy as np

from stack.components import PlanOptions
from stack.drivetrain.ackermann import SteeredWheels
from stack.drivetrain.description import LidarDescription, RobotDescription
from stack.drivetrain.differential import Wheels
from stack.drivetrain.limits import Limits
from stack.drivetrain.omnidirectional import OmniWheels
from stack.errors import NavigationError
from stack.frames.buffer import TransformBuffer
from stack.perception.obstacle_memory import ObstacleMemory
from stack.perception.smoothing import smooth_observation
from stack.planning.astar import Astar, AstarParameters
from stack.types import (
    STANDSTILL,
    CostGrid,
    Footprint,
    Observation,
    Odometry,
    Path,
    Pose2D,
    PoseEstimate,
    Scan,
    Twist,
    wrap_angle,
)

RECTANGLE = Footprint(np.array([[-0.25, -0.2], [0.25, -0.2], [0.25, 0.2], [-0.25, 0.2]]))


def outline(inscribed: float, circumscribed: float) -> Footprint:
    """A rectangle with these radii, metres."""
    half = sqrt(circumscribed**2 - inscribed**2)
    return Footprint(np.array([[-half, -inscribed], [half, -inscribed],
                               [half, inscribed], [-half, inscribed]]))  # fmt: skip


def robot(footprint: Footprint = RECTANGLE, *, lidar: bool = True, **limits) -> RobotDescription:
    return RobotDescription(
        "toy", footprint, 0.3, FilePath("toy.urdf"), Wheels(("l",), ("r",), 0.08, 0.35),
        limits=Limits(**limits), lidar=LidarDescription(Pose2D(0.0, 0.0)) if lidar else None,
    )  # fmt: skip


def moving(kind: str, footprint: Footprint = RECTANGLE, **limits) -> RobotDescription:
    """A robot by its kind of drive; a car's turning radius is 0.5 m."""
    made = robot(footprint, **limits)
    if kind == "omni":
        mounts = tuple(Pose2D(0.2 * cos(a), 0.2 * sin(a), a + pi / 2) for a in (0.0, 2.1, 4.2))
        wheels: OmniWheels | SteeredWheels = OmniWheels(("a", "b", "c"), mounts, 0.05)
        made = replace(made, limits=Limits(**{"lateral_speed": 0.6, **limits}), wheels=wheels)
    if kind == "ackermann":
        wheels = SteeredWheels(("sl", "sr"), ("l", "r"), 0.05, 0.3, 0.3, atan2(0.3, 0.5), 4.0)
        made = replace(made, wheels=wheels)
    return made


def room(width: float, depth: float) -> list[tuple[float, float, float, float]]:
    """Four walls as segments x1, y1, x2, y2."""
    return [
        (0, 0, width, 0), (width, 0, width, depth), (width, depth, 0, depth), (0, depth, 0, 0),
    ]  # fmt: skip


@dataclass
class ToyWorld:
    """Walls (segments), round obstacles (x, y, radius), and one robot with lagging wheels."""

    walls: list[tuple[float, float, float, float]]
    robot: RobotDescription
    pose: Pose2D = Pose2D(1.0, 1.0)
    circles: list[tuple[float, float, float]] = field(default_factory=list)
    beams: int = 240
    period: float = 0.05
    time: float = 0.0
    twist: Twist = STANDSTILL
    scan: Scan | None = None
    nearest: float = np.inf
    frozen_scan: bool = False
    lidar: str = "lidar"

    def __post_init__(self) -> None:
        self.frames, self._memory = TransformBuffer(), ObstacleMemory(self.robot)
        self.odometry_pose = Pose2D(0.0, 0.0)
        self._steps = 0
        corners = self.robot.footprint.points
        edges = zip(corners, np.roll(corners, -1, axis=0), strict=True)
        self._outline = np.vstack([np.linspace(a, b, 40, endpoint=False) for a, b in edges])
        walls = np.array(self.walls, dtype=float)
        self._starts, self._spans = walls[:, :2], walls[:, 2:] - walls[:, :2]
        self._squares = np.einsum("wk,wk->w", self._spans, self._spans)
        self._see()
        self._sense({self.lidar: self.scan})

    @property
    def odometry(self) -> Odometry:
        return Odometry(self.time, self.odometry_pose, self.twist)

    @property
    def estimate(self) -> PoseEstimate:
        return PoseEstimate(self.pose, np.eye(3) * 1e-4, 0.9)

    def drive(self, command: Twist) -> None:
        """Half the way to the command in each step, then a step along the arc; scans at 10 Hz."""
        driven = Twist(
            0.5 * (self.twist.linear + command.linear),
            0.5 * (self.twist.angular + command.angular),
            0.5 * (self.twist.lateral + command.lateral),
        )
        self.twist = self.robot.drivetrain.feasible(driven)
        turn = self.twist.angular * self.period
        forward, left = self.twist.linear * self.period, self.twist.lateral * self.period
        c, s = cos(turn / 2), sin(turn / 2)
        step = Pose2D(c * forward - s * left, s * forward + c * left, turn)
        self.pose, self.odometry_pose = self.pose.compose(step), self.odometry_pose.compose(step)
        self.time = round(self.time + self.period, 9)
        self._steps += 1
        if self._steps % 2 == 0 and not self.frozen_scan:
            self._see()
        fresh = self.scan is not None and self.scan.stamp == self.time
        self._sense({self.lidar: self.scan} if fresh else {})
        centre = np.array([[self.pose.x, self.pose.y]])
        if self._clearance(centre) - self.robot.footprint.circumscribed_radius < self.nearest:
            self.nearest = min(self.nearest, self.clearance())

    def _sense(self, scans: dict[str, Scan]) -> None:
        self.frames.add(self.odometry)
        seen = scans if self.robot.all_lidars else {}
        observation = smooth_observation(Observation(self.time, seen))
        self.obstacles = self._memory.update(observation, self.frames)

    def _see(self) -> None:
        lidar = self.robot.lidar
        if lidar is None or lidar.field_of_view == 2 * np.pi:
            first, apart = 0.0, 2 * np.pi / self.beams
        else:
            first, apart = -lidar.field_of_view / 2, lidar.field_of_view / (self.beams - 1)
        angles = first + apart * np.arange(self.beams)
        c, s = np.cos(angles + self.pose.heading), np.sin(angles + self.pose.heading)
        (ex, ey), (rx, ry) = self._spans.T[..., None], self._starts.T[..., None]
        rx, ry = rx - self.pose.x, ry - self.pose.y
        with np.errstate(all="ignore"):  # (walls, beams)
            cross = c * ey - s * ex
            along, share = (rx * ey - ry * ex) / cross, (rx * s - ry * c) / cross
        hit = (along > 0) & (share >= 0) & (share <= 1)
        best = np.where(hit, along, np.inf).min(axis=0)
        for x, y, radius in self.circles:
            rx, ry = x - self.pose.x, y - self.pose.y
            middle = rx * c + ry * s
            root = radius**2 - (rx * rx + ry * ry - middle**2)
            hit = (root >= 0) & (middle > 0)
            best[hit] = np.minimum(best[hit], middle[hit] - np.sqrt(root[hit]))
        best[best > 12.0] = np.inf
        self.scan = Scan(self.time, best.astype(np.float32), first, apart, 0.05, 12.0)

    def clearance(self) -> float:
        """Metres between the outline (points 1 cm apart) and the nearest thing."""
        return self._clearance(self.pose.transform(self._outline))

    def _clearance(self, points) -> float:
        from_starts = points[:, None] - self._starts
        share = np.einsum("pwk,wk->pw", from_starts, self._spans) / self._squares
        away = from_starts - np.clip(share, 0.0, 1.0)[..., None] * self._spans
        nearest = float(np.sqrt(np.einsum("pwk,pwk->pw", away, away).min()))
        for x, y, radius in self.circles:
            nearest = min(nearest, float(np.hypot(*(points - (x, y)).T).min()) - radius)
        return nearest


class ToyCostmap:
    """The true obstacles of a toy world, inflated, seen when `update` is called."""

    def __init__(self, world: ToyWorld, resolution: float = 0.05, inflation: float = 0.55) -> None:
        self._world, self._resolution, self._inflation = world, resolution, inflation
        self.version, self.cleared = 0, 0
        self._drawn: object = None
        self.update()

    def update(self, *_: object) -> None:
        world = self._world
        drawn = (tuple(world.walls), tuple(world.circles))
        if drawn == self._drawn:
            return
        self._drawn = drawn
        ends = np.array(world.walls).reshape(-1, 2)
        low, high = ends.min(axis=0) - 0.2, ends.max(axis=0) + 0.2
        columns, rows = np.ceil((high - low) / self._resolution).astype(int)
        free = np.ones((rows, columns), np.uint8)

        def cells(points):
            x = np.floor((points[:, 0] - low[0]) / self._resolution).astype(int)
            y = np.floor((points[:, 1] - low[1]) / self._resolution).astype(int)
            free[np.clip(y, 0, rows - 1), np.clip(x, 0, columns - 1)] = 0

        for x1, y1, x2, y2 in world.walls:
            share = np.linspace(0, 1, 2 + int(hypot(x2 - x1, y2 - y1) / 0.02))[:, None]
            cells(np.array([x1, y1]) + share * np.array([x2 - x1, y2 - y1]))
        for x, y, radius in world.circles:
            grid = np.stack(np.meshgrid(*[np.arange(-radius, radius, 0.02)] * 2), -1).reshape(-1, 2)
            cells(grid[np.hypot(*grid.T) <= radius] + (x, y))
        away = cv2.distanceTransform(free, cv2.DIST_L2, cv2.DIST_MASK_PRECISE) * self._resolution
        inscribed = world.robot.footprint.inscribed_radius
        costs = 252 * np.exp(-4.0 * (away - inscribed))
        costs[away > self._inflation] = 0
        costs[away <= inscribed] = 253
        costs[away == 0] = 254
        self.grid = CostGrid(costs.astype(np.uint8), self._resolution, (low[0], low[1]))
        marks = np.where(away == 0, 254, 0).astype(np.uint8)
        self.marks = CostGrid(marks, self._resolution, (low[0], low[1]))
        self.version += 1

    layers = ("static", "obstacle")
    way_out = None
    forbidden: ClassVar[dict[str, np.ndarray]] = {}

    def zones_between(self, start: Pose2D, goal: Pose2D) -> tuple[str, ...]:
        return ()

    @property
    def view(self) -> CostGrid:
        return self.grid

    @property
    def ground(self) -> CostGrid:
        return self.marks

    def copied(self) -> ToyCostmap:
        return self

    def release(self) -> None:
        """The grid is replaced, never modified."""

    def clear_around(self, pose: Pose2D, radius: float, *, layer: str | None = None) -> None:
        self.cleared_around = (pose, radius, layer)

    def clear(self, *, layer: str | None = None) -> None:
        self.cleared += 1


class ToyPlanner(Astar):
    """A* that counts its calls, and fails when a test says so."""

    def __init__(self) -> None:
        super().__init__(AstarParameters(tolerance=0.0), robot())
        self.calls = 0
        self.fails: NavigationError | None = None

    def plan(
        self, costs: CostGrid, start: Pose2D, goal: Pose2D, options: PlanOptions | None = None
    ) -> Path:
        self.calls += 1
        if self.fails is not None:
            raise self.fails
        return super().plan(costs, start, goal, options or PlanOptions())


def heading_error(pose: Pose2D, goal: Pose2D) -> float:
    return abs(wrap_angle(pose.heading - goal.heading))
