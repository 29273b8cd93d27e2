"""Oracle: could any robot have reached the goals without touching anybody?

It knows where everybody will be and searches space and time. The set of all positions that a robot
may have reached is propagated in steps: it grows by the distance that the robot drives in a step,
then loses what walls and moving bodies cover. When the set of those that have passed all goals is
no longer empty the case is possible; when nothing is left, or the time is over, it is impossible.
(Reachable sets: S. Petti, T. Fraichard, "Safe motion planning in dynamic environments", IROS 2005,
searched over a grid.)

Every approximation favours the robot, so *impossible* is certain and *possible* is not: it is a
disc of the footprint's inscribed radius, turns on the spot in no time, accelerates in no time to
the largest speed of its limits in any direction, knows its pose exactly and starts at time 0. Doors
are open. A cell is lost only when no point of it is left, and bodies count only at the steps. The
robot stays within the bounds of the world. Where it could delay a recorded person there is no
verdict.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from math import ceil, hypot, sqrt

import numpy as np
from numpy.typing import NDArray

from stack.drivetrain.description import RobotDescription
from stack.geometry.distance_transform import distances_to_zero
from stack.sim.people import People
from stack.sim.people.recorded import APPEARANCE_DISTANCE
from stack.sim.rates import SCENE_RATE
from stack.sim.worlds.rasterise import covered_cells
from stack.sim.worlds.world import World
from stack.types import FloatArray, Pose2D

Mask = NDArray[np.bool_]

RESOLUTION, MAX_CELLS = 0.025, 100_000
"""Side of a cell, metres; larger in worlds that would have more cells."""

STEP = 0.1
"""Seconds between two steps. Two bodies pass 0.35 m of each other's way in it at 3.5 m/s: less than
the chord of a person filling a corridor, so that the robot cannot jump over them."""

WINDOW = 10
"""Steps after which positions are rounded up to whole cells: once in a second this adds the
diagonal of a cell to the robot's way: 4 cm/s with the smallest cells."""

SLACK = 0.2
"""Metres for the steps of the simulation and the rounding to cells, where people appear."""


@dataclass(frozen=True)
class Task:
    """What a robot shall do.

    Attributes:
        start: pose at time 0. goals: to visit in turn. Both in the world frame.
        goal_radius: metres from a goal that count as there.
        time_limit: seconds, from time 0.
    """

    start: Pose2D
    goals: Sequence[Pose2D]
    goal_radius: float
    time_limit: float


@dataclass(frozen=True)
class Ground:
    """Positions at which a robot touches no wall.

    Attributes:
        free: (rows, columns); a cell is free unless no point of it is.
        resolution: side of a cell, metres.
        origin: outer corner of cell (0, 0), world frame, metres.
        radius: of the robot, metres.
    """

    free: Mask
    resolution: float
    origin: tuple[float, float]
    radius: float

    @property
    def diagonal(self) -> float:
        """Diagonal of a cell, metres: the largest distance between two of its points."""
        return sqrt(2.0) * self.resolution

    def within(self, x: float, y: float, radius: float) -> tuple[tuple[slice, slice], Mask]:
        """Return the cells with their centre nearer than a radius to a point.

        Returns:
            The rows and columns near the point, and which of those cells are within, (rows,
            columns).
        """
        rows, columns = self.free.shape
        parts, squares = [], []
        for value, low, count in ((y, self.origin[1], rows), (x, self.origin[0], columns)):
            first = max(0, int((value - radius - low) / self.resolution) - 1)
            last = min(count, ceil((value + radius - low) / self.resolution) + 1)
            part = slice(min(first, count), max(last, 0))
            centres = low + (np.arange(count)[part] + 0.5) * self.resolution
            parts.append(part)
            squares.append((centres - value) ** 2)
        inside: Mask = squares[0][:, None] + squares[1][None, :] < radius * radius
        return (parts[0], parts[1]), inside

    def disc(self, x: float, y: float, radius: float) -> Mask:
        """Return which cells have a point within a disc, (rows, columns)."""
        found: Mask = np.zeros(self.free.shape, np.bool_)
        part, inside = self.within(x, y, radius + 0.5 * self.diagonal)
        found[part] = inside
        return found

    def without(self, bodies: FloatArray) -> Mask:
        """Return the free cells that have a point at which the robot touches no body.

        Args:
            bodies: (n, 3) x, y and radius, world frame, metres.
        """
        left = self.free.copy()
        for x, y, radius in bodies.tolist():
            covering = radius + self.radius - 0.5 * self.diagonal
            if covering > 0.0:
                part, inside = self.within(x, y, covering)
                left[part] &= ~inside
        return left


@dataclass(frozen=True)
class Verdict:
    """What the oracle found.

    Attributes:
        possible: whether all goals can perhaps be reached without a touch; False is certain.
        time: earliest arrival at the last goal, seconds; None if impossible.
        ended: seconds at which the search ended.
        arrival: (rows, columns) earliest arrival at each cell, seconds; inf: never.
        bodies: (n, 3) x, y and radius of the bodies at the end, metres.
        ground: the cells.
    """

    possible: bool
    time: float | None
    ended: float
    arrival: NDArray[np.float32]
    bodies: FloatArray
    ground: Ground


class ReachedSet:
    """All positions that robots with the same goals behind them may have: cells.

    A true position lies in a reached cell, always. Steps are bounded twice: from the step before,
    and from the beginning of the window, whose cells alone are rounded up.
    """

    def __init__(self, ground: Ground, speed: float) -> None:
        """Begin empty.

        Args:
            ground: the cells.
            speed: of the robot, m/s.
        """
        self._ground, self._stride = ground, speed * STEP
        self.cells: Mask = np.zeros(ground.free.shape, np.bool_)
        self._left: NDArray[np.float32] = np.full(ground.free.shape, np.inf, np.float32)

    def grow(self, free: Mask, *, is_last: bool) -> None:
        """Drive for a step into the cells that are free after it.

        Args:
            free: (rows, columns).
            is_last: whether a new window begins: every point of the reached cells is reached.
        """
        near = self._ground.diagonal
        self._left -= self._stride
        if self.cells.any():
            part, distance = self._distances(self.cells, self._stride + near)
            grown = np.zeros_like(self.cells)
            grown[part] = (distance <= self._stride + near) & (self._left[part] <= near)
            self.cells = grown & free
        if is_last:
            self._left.fill(np.inf)
            self.add(self.cells)

    def add(self, cells: Mask) -> None:
        """Add positions, (rows, columns)."""
        if cells.any():
            self.cells = self.cells | cells
            reach = WINDOW * self._stride + 2.0 * self._ground.diagonal
            part, distance = self._distances(cells, reach)
            self._left[part] = np.minimum(self._left[part], distance)

    def _distances(
        self, cells: Mask, reach: float
    ) -> tuple[tuple[slice, slice], NDArray[np.float32]]:
        """Return the distances between centres to the nearest one of some cells, metres.

        Args:
            cells: (rows, columns), at least one.
            reach: metres round the cells in which distances are wanted.

        Returns:
            The rows and columns within reach, and the distances of their cells.
        """
        resolution, parts = self._ground.resolution, []
        for axis, count in enumerate(cells.shape):
            used = np.flatnonzero(cells.any(axis=1 - axis))
            more = ceil(reach / resolution) + 1
            parts.append(slice(max(0, used[0] - more), min(count, used[-1] + more + 1)))
        part = parts[0], parts[1]
        metres: NDArray[np.float32] = distances_to_zero(~cells[part]) * np.float32(resolution)
        return part, metres


def ground_of(world: World, radius: float) -> Ground:
    """Return the positions in a world at which a disc touches nothing that stands.

    Args:
        world: its walls, boxes and cylinders count, on the map or not; doors are open.
        radius: of the disc, metres.
    """
    x_min, y_min, x_max, y_max = world.bounds
    area = (x_max - x_min) * (y_max - y_min)
    resolution = max(RESOLUTION, sqrt(area / MAX_CELLS))
    distance = distances_to_zero(~covered_cells(world, resolution))
    # The wall is within half a diagonal of its cell's centre, the robot of its own.
    free = (distance + sqrt(2.0)) * resolution >= radius
    return Ground(free, resolution, (x_min, y_min), radius)


def search(ground: Ground, task: Task, speed: float, bodies: Iterable[FloatArray]) -> Verdict:
    """Search space and time.

    Args:
        ground: where the robot can be.
        task: start, goals and time limit.
        speed: the largest of the robot, m/s.
        bodies: (n, 3) x, y and radius of the moving bodies, world frame, metres, at each multiple
            of STEP from 0 on.
    """
    stages = [ReachedSet(ground, speed) for _ in task.goals]
    goals = [ground.disc(goal.x, goal.y, task.goal_radius) for goal in task.goals]
    arrival = np.full(ground.free.shape, np.inf, np.float32)
    stages[0].add(ground.disc(task.start.x, task.start.y, 0.0))
    time, found, places = 0.0, False, np.empty((0, 3))
    for step, places in enumerate(bodies):
        time = round(step * STEP, 3)
        free = ground.without(places)
        if step > 0:
            for stage in stages:
                stage.grow(free, is_last=step % WINDOW == 0)
        found = _passed(stages, goals)
        for stage in stages:
            arrival[stage.cells & np.isinf(arrival)] = time
        alive = any(stage.cells.any() for stage in stages)
        if found or not alive or time >= task.time_limit:
            break
    return Verdict(found, time if found else None, time, arrival, places, ground)


def _passed(stages: Sequence[ReachedSet], goals: Sequence[Mask]) -> bool:
    """Send on who is at a goal to the next set; return whether the last goal is reached."""
    for stage, goal, following in zip(stages, goals, [*stages[1:], None], strict=True):
        there = stage.cells & goal
        if following is None:
            return bool(there.any())
        following.add(there)
    return False


def is_predictable(world: World) -> bool:
    """Whether there are people, and none of them reacts to the robot."""
    return bool(world.people) and all(
        person.model == "recorded" or (person.model == "loop" and not person.yields)
        for person in world.people
    )


def walks(world: World, seed: int) -> Iterator[FloatArray]:
    """Yield x, y and radius (n, 3) of who is there, metres, at each multiple of STEP from 0 on.

    They are those of the simulation as long as nobody is touched, and no recorded person appears
    within APPEARANCE_DISTANCE of the robot.

    Args:
        world: with people who react to nobody.
        seed: of the run.
    """
    people = People(world, seed)
    period = 1.0 / SCENE_RATE
    for _ in iter(int, 1):
        yield people.places.copy()
        for _ in range(round(STEP / period)):
            people.walk(period, ())


def judge(world: World, robot: RobotDescription, seed: int, task: Task) -> Verdict | None:
    """Return whether a robot can perhaps do a task among people without touching anybody.

    Args:
        world: with its people.
        robot: its footprint and speed limits count.
        seed: of the run.
        task: start, goals and time limit.

    Returns:
        None where nobody walks, and where the ways of people depend on the robot: they react to it,
        or it may be where a recorded person appears, who then comes later.
    """
    if not is_predictable(world):
        return None
    limits = robot.limits
    speed = max(limits.linear_speed, limits.reverse_speed, limits.lateral_speed)
    ground = ground_of(world, robot.footprint.inscribed_radius)
    verdict = search(ground, task, speed, walks(world, seed))
    return None if _may_delay(world, robot, seed, task, verdict) else verdict


def _may_delay(
    world: World, robot: RobotDescription, seed: int, task: Task, verdict: Verdict
) -> bool:
    """Whether a robot may be so near to where a recorded person appears that they come later.

    People appear where their track begins, and where they are at time 0.
    """
    reached, at_first = np.isfinite(verdict.arrival), People(world, seed).positions
    for person, (x, y) in zip(world.people, at_first, strict=True):
        if person.track is None:
            continue
        near = APPEARANCE_DISTANCE + robot.footprint.circumscribed_radius + person.radius + SLACK
        begin_x, begin_y = person.track[0, 1:3].tolist()
        part, inside = verdict.ground.within(begin_x, begin_y, near)
        if hypot(x - task.start.x, y - task.start.y) < near or (reached[part] & inside).any():
            return True
    return False
