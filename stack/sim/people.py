"""People who walk round loops and, most of them, stop for a robot in their way."""

from __future__ import annotations

from math import hypot

import numpy as np

from stack.sim.worlds.world import Person
from stack.types import FloatArray, Pose2D

YIELD_GAP = 0.5
"""Metres between a person's front and the robot below which the person stops."""

ELBOW_ROOM = 0.05
"""Metres that a person wants on either side to walk past a robot."""


class Walker:
    """One person on a closed polyline, at constant speed but for pauses at its corners.

    Attributes:
        x: world frame, metres.
        y: likewise.
    """

    def __init__(self, person: Person, robot_radius: float) -> None:
        self._person, self._robot_radius = person, robot_radius
        self._points = np.asarray(person.waypoints, dtype=np.float64)
        following = np.roll(self._points, -1, axis=0)
        self._lengths: list[float] = np.hypot(*(following - self._points).T).tolist()
        self._leg, self._along, self._resting = 0, 0.0, 0.0
        self._set_off(person.start * sum(self._lengths))
        self.x, self.y = self._place()

    def walk(self, period: float, robot: Pose2D) -> bool:
        """Let a period pass; whether the person moved."""
        if self._resting > 0.0:
            self._resting = max(0.0, self._resting - period)
            return False
        if self._person.yields and self._in_the_way(robot):
            return False
        self._along += self._person.speed * period
        if self._along >= self._lengths[self._leg]:
            left_over = self._along - self._lengths[self._leg]
            self._leg, self._along = (self._leg + 1) % len(self._lengths), 0.0
            self._resting = self._person.pause
            if not self._resting:
                self._set_off(left_over)
        self.x, self.y = self._place()
        return True

    def _set_off(self, distance: float) -> None:
        if sum(self._lengths) <= 0.0:
            return
        while distance >= self._lengths[self._leg]:
            distance -= self._lengths[self._leg]
            self._leg = (self._leg + 1) % len(self._lengths)
        self._along = distance

    def _place(self) -> tuple[float, float]:
        x, y = self._points[self._leg]
        c, s = self._direction()
        return float(x) + c * self._along, float(y) + s * self._along

    def _direction(self) -> tuple[float, float]:
        start, end = self._points[self._leg], self._points[(self._leg + 1) % len(self._points)]
        length = self._lengths[self._leg]
        if length <= 0.0:
            return 1.0, 0.0
        return float(end[0] - start[0]) / length, float(end[1] - start[1]) / length

    def _in_the_way(self, robot: Pose2D) -> bool:
        dx, dy = robot.x - self.x, robot.y - self.y
        both = self._robot_radius + self._person.radius
        if hypot(dx, dy) > both + YIELD_GAP:
            return False
        c, s = self._direction()
        ahead, aside = c * dx + s * dy, abs(c * dy - s * dx)
        return ahead > 0.0 and aside < both + ELBOW_ROOM


class People:
    """Everybody in a world, in the world's order."""

    def __init__(self, people: tuple[Person, ...], robot_radius: float) -> None:
        self._walkers = [Walker(person, robot_radius) for person in people]
        self._radii = [person.radius for person in people]

    def walk(self, period: float, robot: Pose2D) -> bool:
        """Let a period pass; whether anybody moved."""
        return any([walker.walk(period, robot) for walker in self._walkers])

    @property
    def places(self) -> FloatArray:
        """(n, 3) x, y, radius, metres."""
        rows = [(w.x, w.y, r) for w, r in zip(self._walkers, self._radii, strict=True)]
        return np.array(rows, dtype=np.float64).reshape(-1, 3)
