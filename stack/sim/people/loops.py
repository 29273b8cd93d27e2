"""People who walk along closed loops and may stop for a robot."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot

import numpy as np

from stack.sim.people.bumps import Bump
from stack.sim.worlds.world import Person
from stack.types import Pose2D

YIELD_GAP = 0.5
"""Distance between person and robot, metres, below which the person stops."""

SIDE_CLEARANCE = 0.05
"""Distance, metres, that a person keeps on each side when passing a robot."""


Robots = Sequence[tuple[Pose2D, float]]
"""True pose and circumscribed radius, metres, of each robot."""


class Walker:
    """One person on a closed polyline: constant speed, with pauses at the corners.

    Attributes:
        place: position in the world frame, metres.
    """

    def __init__(self, person: Person) -> None:
        self._person = person
        points = np.asarray(person.waypoints, dtype=np.float64)
        to_next = np.roll(points, -1, axis=0) - points
        self._corners: list[tuple[float, float]] = list(map(tuple, points.tolist()))
        self._lengths: list[float] = np.hypot(*to_next.T).tolist()
        self._directions = [
            (dx / length, dy / length) if length > 0.0 else (1.0, 0.0)
            for (dx, dy), length in zip(to_next.tolist(), self._lengths, strict=True)
        ]
        self._segment, self._along, self._pause_left = 0, 0.0, 0.0
        self._bump = Bump()
        self._advance(person.start * sum(self._lengths))
        self.place = self._position()

    def walk(self, period: float, robots: Robots, *, touch: float | None = None) -> bool:
        """Advance by `period` seconds; return whether the person moved.

        `touch` is the depth by which a robot and the person overlap, metres; None: no touch.
        """
        share = 1.0
        if touch is not None or self._bump.is_under_way:
            share = self._bump.share(period, touch)
            if share <= 0.0:
                return self._step_back(self._person.speed * period * -share)
        if self._pause_left > 0.0:
            self._pause_left = max(0.0, self._pause_left - period)
            return False
        if self._person.yields:
            for robot, radius in robots:
                if self._is_blocked_by(robot, radius):
                    return False
        self._along += self._person.speed * period * share
        if self._along >= self._lengths[self._segment]:
            left_over = self._along - self._lengths[self._segment]
            self._segment, self._along = (self._segment + 1) % len(self._lengths), 0.0
            self._pause_left = self._person.pause
            if not self._pause_left:
                self._advance(left_over)
        self.place = self._position()
        return True

    def _step_back(self, distance: float) -> bool:
        """Go back by a distance in metres, at most to the last corner; return whether it did."""
        before = self._along
        self._along = max(0.0, before - distance)
        self.place = self._position()
        return self._along != before

    def _advance(self, distance: float) -> None:
        """Go to `distance` metres after the start of the current segment."""
        if sum(self._lengths) <= 0.0:
            return
        while distance >= self._lengths[self._segment]:
            distance -= self._lengths[self._segment]
            self._segment = (self._segment + 1) % len(self._lengths)
        self._along = distance

    def _position(self) -> tuple[float, float]:
        x, y = self._corners[self._segment]
        c, s = self._directions[self._segment]
        return x + c * self._along, y + s * self._along

    def _is_blocked_by(self, robot: Pose2D, radius: float) -> bool:
        """Whether a robot is close ahead, within the width of person and robot."""
        dx, dy = robot.x - self.place[0], robot.y - self.place[1]
        radii = radius + self._person.radius
        if hypot(dx, dy) > radii + YIELD_GAP:
            return False
        c, s = self._directions[self._segment]
        ahead, aside = c * dx + s * dy, abs(c * dy - s * dx)
        return ahead > 0.0 and aside < radii + SIDE_CLEARANCE
