"""Furnished rooms at random: crates, tables and chairs on thin legs, posts, people walking."""

from __future__ import annotations

from math import cos, hypot, pi, sin

import numpy as np
from numpy.random import Generator

from stack.sim.worlds.world import Box, Cylinder, Person, Wall, World
from stack.types import Pose2D

FREE = 0.1
"""Metres kept free around the robot at the start."""


class Room:
    """A room that is furnished piece by piece; nothing is placed on the robot.

    Args:
        random: of all sizes and places.
        clear: radius of the robot, metres; it starts at the origin.
    """

    def __init__(self, random: Generator, clear: float) -> None:
        self._random, self._clear = random, clear + FREE
        self._west, self._south = (-self._uniform(1.0, 4.0) for _ in range(2))
        self._east, self._north = (self._uniform(1.0, 4.0) for _ in range(2))
        self._boxes: list[Box] = []
        self._cylinders: list[Cylinder] = []

    def world(self, people: int) -> World:
        """Furnish the room; `people` walk through it, every second one yields to the robot."""
        w, s, e, n = self._west, self._south, self._east, self._north
        corners = np.array([(w, s), (e, s), (e, n), (w, n), (w, s)])
        for _ in range(self._random.integers(1, 6)):
            self._crate()
        for _ in range(self._random.integers(0, 4)):
            self._post()
        for _ in range(self._random.integers(1, 6)):
            self._legs()
        return World(
            "clutter", (w, s, e, n), (Wall(corners),), tuple(self._boxes), tuple(self._cylinders),
            people=tuple(self._person(number) for number in range(people)),
        )  # fmt: skip

    def _uniform(self, low: float, high: float) -> float:
        return float(self._random.uniform(low, high))

    def _place(self) -> tuple[float, float]:
        return self._uniform(self._west, self._east), self._uniform(self._south, self._north)

    def _crate(self) -> None:
        (x, y), heading = self._place(), self._uniform(-pi, pi)
        length, width = self._uniform(0.1, 0.9), self._uniform(0.1, 0.6)
        if hypot(x, y) > self._clear + hypot(length, width) / 2.0:
            self._boxes.append(Box(Pose2D(x, y, heading), (length, width, self._uniform(0.5, 1.0))))

    def _post(self) -> None:
        (x, y), radius = self._place(), self._uniform(0.03, 0.25)
        if hypot(x, y) > self._clear + radius:
            self._cylinders.append(Cylinder(x, y, radius))

    def _legs(self) -> None:
        """Four legs of a chair or a table."""
        (x, y), heading, radius = self._place(), self._uniform(-pi, pi), self._uniform(0.01, 0.03)
        length, width = self._uniform(0.35, 1.4), self._uniform(0.35, 0.8)
        c, s = cos(heading), sin(heading)
        for ahead in (-length / 2.0, length / 2.0):
            for left in (-width / 2.0, width / 2.0):
                leg = Cylinder(x + c * ahead - s * left, y + s * ahead + c * left, radius, 0.7)
                if hypot(leg.x, leg.y) > self._clear + radius:
                    self._cylinders.append(leg)

    def _person(self, number: int) -> Person:
        """Someone who walks through furniture, but never starts on the robot."""
        points = np.array([self._place() for _ in range(3)])
        away = points / np.maximum(np.hypot(*points.T), 1e-6)[:, None]
        points[0] = away[0] * max(1.0, self._clear + 0.5)
        return Person(
            f"person {number + 1}", points, self._uniform(0.3, 1.2), self._uniform(0.15, 0.25),
            self._uniform(0.0, 2.0), yields=number % 2 == 0,
        )  # fmt: skip
