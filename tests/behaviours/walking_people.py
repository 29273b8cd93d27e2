"""A robot that drives its paths at once at their speed, among people who walk as functions say."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise
from math import atan2, hypot

import numpy as np

from behaviours.testing import ScriptedRobot, ScriptedTask
from stack.types import FloatArray, Path, Pose2D, StandingObject, TrackedObject

PERIOD = 0.1
FORGET = 1.0
MOVED = 0.3
THING = 1000
SPEED = 0.8

Walk = Callable[[float], tuple[float, float]]
"""Time in seconds to a position in metres."""


def track(
    number: int, at: tuple[float, float], velocity: tuple[float, float] = (0.0, 0.0),
    deviation: float = 0.05, stamp: float = 0.0,
) -> TrackedObject:  # fmt: skip
    """A track with equal deviations in all directions."""
    covariance = np.diag([deviation**2, deviation**2, 0.1, 0.1])
    return TrackedObject(number, stamp, at, velocity, 0.2, covariance)


def standing(
    number: int, at: tuple[float, float], since: float, radius: float = 0.2
) -> StandingObject:
    """An object that has not moved."""
    item = track(number, at)
    return StandingObject(number, since, at, (0.0, 0.0), radius, item.covariance, since=since)


@dataclass
class Escort(ScriptedRobot):
    """Sees people unless `hides` says no, as the tracker does: for a second it expects them.

    Who comes into sight again is a standing object until they have moved by MOVED.

    Attributes:
        walks: of the people.
        hides: whether the robot at a pose cannot see a position.
        unmoved: numbers of people who have not moved by MOVED since they came into sight.
        things: (x, y, radius) of objects that stand.
        corner: a point over which plans lead from smaller x; None: straight.
        way: (time, pose) in each step.
    """

    walks: list[Walk] = field(default_factory=list)
    hides: Callable[[Pose2D, tuple[float, float]], bool] = lambda pose, at: False
    unmoved: set[int] = field(default_factory=set)
    things: list[tuple[float, float, float]] = field(default_factory=list)
    corner: tuple[float, float] | None = None
    way: list[tuple[float, Pose2D]] = field(default_factory=list)
    driven: Path | None = None
    along: float = 0.0

    def __post_init__(self) -> None:
        self._numbers = list(range(1, len(self.walks) + 1))
        self._seen: dict[int, TrackedObject] = {}
        self._first: dict[int, tuple[float, float]] = {}
        self._since: dict[int, float] = {}
        self._look()

    def plan(self, goal: Pose2D, start: Pose2D | None = None) -> ScriptedTask:
        task = super().plan(goal, start)
        corner = [] if self.corner is None or self._past_corner else [self.corner]
        points = [(self.pose.x, self.pose.y), *corner, (goal.x, goal.y)]
        headings = [atan2(b[1] - a[1], b[0] - a[0]) for a, b in pairwise(points)]
        table = np.array([(*p, h) for p, h in zip(points, [*headings, goal.heading], strict=True)])
        task.succeed(Path(table))
        return task

    @property
    def _past_corner(self) -> bool:
        assert self.corner is not None
        return self.pose.x > self.corner[0] - 0.3

    def follow_path(self, path: Path) -> ScriptedTask:
        task = super().follow_path(path)
        self.driven, self.along = path, 0.0
        return task

    def navigate_to(
        self, goal: Pose2D, *, tolerance: float | None = None, partial: bool = False
    ) -> ScriptedTask:
        task = super().navigate_to(goal, tolerance=tolerance, partial=partial)
        points = [(self.pose.x, self.pose.y, 0.0), (goal.x, goal.y, goal.heading)]
        if self.corner is not None and not self._past_corner:
            points.insert(1, (*self.corner, 0.0))
        self.driven, self.along = Path(np.array(points)), 0.0
        return task

    def advance(self, seconds: float) -> None:
        super().advance(seconds)
        if self.driven is not None and self.motion.status.name == "RUNNING":
            self.along += SPEED * seconds
            before = self.pose
            self.pose = at_length(self.driven.points, self.along)
            step = before.distance_to(self.pose)
            heading = before.heading
            if step > 1e-6:
                heading = before.bearing_to(self.pose)
            self.pose = Pose2D(self.pose.x, self.pose.y, heading)
            if self.along >= self.driven.length:
                self.motion.succeed()
        else:
            self.driven = None
            turn = self.twist.angular * seconds
            self.pose = self.pose.compose(Pose2D(self.twist.linear * seconds, 0.0, turn))
        self.odometry = self.pose
        self.way.append((self.time, self.pose))
        self._look()

    def _look(self) -> None:
        """Update the tracks; who was out of sight for FORGET gets a new number."""
        for n, walk in enumerate(self.walks):
            at, later = walk(self.time), walk(self.time + 0.01)
            velocity = ((later[0] - at[0]) / 0.01, (later[1] - at[1]) / 0.01)
            number = self._numbers[n]
            if not self.hides(self.pose, at):
                self._seen[number] = track(number, at, velocity, stamp=self.time)
                first = self._first.setdefault(number, at)
                if hypot(at[0] - first[0], at[1] - first[1]) >= MOVED:
                    self.unmoved.discard(number)
            elif number in self._seen and self.time - self._seen[number].stamp > FORGET:
                del self._seen[number]
                self._numbers[n] = max(self._numbers) + 1
                self.unmoved.add(self._numbers[n])
        found = []
        for number, last in self._seen.items():
            age = self.time - last.stamp
            moved = last.at(self.time)
            found.append(track(number, moved.position, moved.velocity, 0.05 + 0.5 * age, self.time))
        self.tracks = tuple(item for item in found if item.id not in self.unmoved)
        in_sight = [(n, *self._first[n], 0.2) for n in self._seen if n in self.unmoved]
        in_sight += [
            (THING + n, x, y, radius) for n, (x, y, radius) in enumerate(self.things)
            if not self.hides(self.pose, (x, y))
        ]  # fmt: skip
        self.standing_objects = tuple(
            standing(n, (x, y), self._since.setdefault(n, self.time), radius)
            for n, x, y, radius in in_sight
        )


def at_length(points: FloatArray, along: float) -> Pose2D:
    """Return the pose on a path (n, 3) after some metres."""
    steps = np.hypot(*np.diff(points[:, :2], axis=0).T)
    sums = np.concatenate([[0.0], np.cumsum(steps)])
    along = min(along, float(sums[-1]))
    return Pose2D(
        float(np.interp(along, sums, points[:, 0])),
        float(np.interp(along, sums, points[:, 1])),
        float(points[-1, 2]),
    )
