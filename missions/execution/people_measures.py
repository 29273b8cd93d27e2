"""Measures of a drive among people, from the truth of the simulation.

The zones are those of E. T. Hall, "The Hidden Dimension" (1966): intimate up to 0.45 m, personal up
to 1.2 m; here between the surfaces of robot and person.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import cos, hypot, inf, isfinite, isnan, sin
from typing import Any

import numpy as np

from stack.compilation import KernelTypes
from stack.types import FloatArray, Footprint, Pose2D, Twist

Velocity = tuple[float, float]

INTIMATE, PERSONAL = 0.45, 1.2
"""Metres between the surfaces that bound Hall's zones."""

TOUCH = 0.02
"""Metres between the surfaces below which robot and person touch."""

EPISODE_GAP = 0.5
"""Seconds without touch after which a touch is a new contact."""

TOWARDS = 0.05
"""Speed towards the other, m/s, above which a person moved into the other."""

MOVES = 0.02
"""Speed above which the robot moved, m/s."""

STANDOFF_TIME, STANDOFF_WAY, STANDOFF_DISTANCE = 20.0, 0.3, 2.0
"""A standoff: the robot gets on by less than so many metres in so many seconds, with a person this
near all the time."""

LONGEST_COLLISION_TIME = 10.0
"""Times to collision are measured up to this, seconds."""


@dataclass(frozen=True, slots=True)
class PeopleContact:
    """A contact of robot and person.

    Attributes:
        time: seconds.
        robot: speed of the robot's centre towards the person just before, m/s.
        person: speed of the person towards the robot, m/s.
        turns: whether the robot turned in place: its outline moved though its centre stood.
    """

    time: float
    robot: float
    person: float
    turns: bool

    @property
    def by(self) -> str:
        """Who moved into whom: the robot, if it was the faster one, or the person."""
        if self.robot > TOWARDS and self.robot > self.person:
            return "robot"
        moving = abs(self.robot) > MOVES or self.turns
        return "person, robot moving" if moving else "person, robot standing"


@dataclass(frozen=True, slots=True)
class _Moment:
    """A step; people: x, y and radius of each, in the frame of the pose; nan: not there."""

    time: float
    pose: Pose2D
    twist: Twist
    people: list[list[float]]


class PeopleMeasures:
    """Measures of one run; `update` is called in each step.

    Attributes:
        contacts: with people, in the order of time.
        least_distance: smallest distance between the surfaces, metres; inf without people.
        intimate: seconds within INTIMATE of a person. personal: within PERSONAL.
        least_collision_time: smallest time after which robot and a person would touch if both kept
            their velocity, while they do not touch, seconds.
        standoffs: number of standoffs.
        longest_stand: longest time that the robot stood, seconds.
    """

    @staticmethod
    def kernels() -> KernelTypes:
        """Return the kernels of the measures."""
        from missions.execution.kernels import GAPS

        return GAPS

    def __init__(self, footprint: Footprint) -> None:
        from missions.execution.kernels import disc_gaps  # imports numba

        self._disc_gaps = disc_gaps
        self._corners = np.ascontiguousarray(footprint.points, dtype=np.float64)
        self._radius = footprint.circumscribed_radius
        self.contacts: list[PeopleContact] = []
        self.least_distance = self.least_collision_time = inf
        self.intimate = self.personal = self.longest_stand = 0.0
        self.standoffs = 0
        self._before: _Moment | None = None
        self._touched_at = -inf
        self._stands_since: float | None = None
        self._held_at: tuple[float, Pose2D] | None = None
        self._counted = False

    def update(self, time: float, pose: Pose2D, twist: Twist, people: FloatArray) -> None:
        """Add a step.

        Args:
            time: seconds.
            pose: true pose of the base.
            twist: true velocity, base frame.
            people: (n, 3) x, y and radius of the same people in each step, in the same order and
                frame as the pose; nan: not there.
        """
        now, before = _Moment(time, pose, twist, people.tolist()), self._before
        self._before = now
        self._stand(now)
        gaps: list[float] = self._gaps(pose, people).tolist()
        there = [number for number, gap in enumerate(gaps) if not isnan(gap)]
        if not there or (before is not None and time <= before.time):
            return
        nearest = min(there, key=gaps.__getitem__)
        gap = gaps[nearest]
        self.least_distance = min(self.least_distance, max(0.0, gap))
        self._hold(now, gap)
        if before is None:
            return
        period = time - before.time
        self.intimate += period * (gap < INTIMATE)
        self.personal += period * (gap < PERSONAL)
        velocities = _velocities(before, now)
        self._look_ahead(now, gaps, velocities)
        if gap <= TOUCH and nearest in velocities:
            if time - self._touched_at >= EPISODE_GAP:
                self.contacts.append(_contact(before, nearest, velocities[nearest]))
            self._touched_at = time

    def summary(self) -> dict[str, Any]:
        """Return the figures for a report; distances and times that were never reached are None."""

        def figure(value: float) -> float | None:
            return round(value, 3) if isfinite(value) else None

        return {
            "contacts": [
                {
                    "time": round(item.time, 3),
                    "by": item.by,
                    "robot": round(item.robot, 3),
                    "person": round(item.person, 3),
                }
                for item in self.contacts
            ],
            "least_distance": figure(self.least_distance),
            "seconds_intimate": round(self.intimate, 2),
            "seconds_personal": round(self.personal, 2),
            "least_time_to_collision": figure(self.least_collision_time),
            "standoffs": self.standoffs,
            "longest_stand": round(self.longest_stand, 2),
        }

    def _gaps(self, pose: Pose2D, people: FloatArray) -> FloatArray:
        """Return (n,) distances between the outline and each person, metres; nan: not there.

        Farther away than PERSONAL the outline counts as its circumscribed circle.
        """
        gaps: FloatArray = self._disc_gaps(
            people, self._corners, self._radius, PERSONAL, pose.x, pose.y, pose.heading
        )
        return gaps

    def _look_ahead(
        self, now: _Moment, gaps: Sequence[float], velocities: Mapping[int, Velocity]
    ) -> None:
        """Update the smallest time to collision, of discs with the distance of the surfaces."""
        c, s = cos(now.pose.heading), sin(now.pose.heading)
        own = (
            c * now.twist.linear - s * now.twist.lateral,
            s * now.twist.linear + c * now.twist.lateral,
        )
        for number, velocity in velocities.items():
            gap, person = gaps[number], now.people[number]
            if gap <= TOUCH or gap > 2.0 * LONGEST_COLLISION_TIME:
                continue
            dx, dy = person[0] - now.pose.x, person[1] - now.pose.y
            vx, vy = velocity[0] - own[0], velocity[1] - own[1]
            touching = hypot(dx, dy) - gap  # distance of the centres at which they touch
            a, b = vx * vx + vy * vy, dx * vx + dy * vy
            root = b * b - a * (dx * dx + dy * dy - touching * touching)
            if b >= 0.0 or root < 0.0 or a < 1e-6:
                continue
            time = (-b - root**0.5) / a
            if time <= LONGEST_COLLISION_TIME:
                self.least_collision_time = min(self.least_collision_time, max(0.0, time))

    def _stand(self, now: _Moment) -> None:
        speed = hypot(now.twist.linear, now.twist.lateral) + abs(now.twist.angular) * self._radius
        if speed > TOWARDS:
            self._stands_since = None
            return
        if self._stands_since is None:
            self._stands_since = now.time
        self.longest_stand = max(self.longest_stand, now.time - self._stands_since)

    def _hold(self, now: _Moment, gap: float) -> None:
        """Count a standoff when the robot has got on too little for STANDOFF_TIME."""
        held = self._held_at
        if held is None or gap > STANDOFF_DISTANCE or held[1].distance_to(now.pose) > STANDOFF_WAY:
            self._held_at, self._counted = (now.time, now.pose), False
        elif not self._counted and now.time - held[0] >= STANDOFF_TIME:
            self.standoffs, self._counted = self.standoffs + 1, True


def _velocities(before: _Moment, now: _Moment) -> dict[int, Velocity]:
    """Return the velocities of those who are there in two moments, m/s, by number."""
    period = now.time - before.time
    return {
        number: ((x - old_x) / period, (y - old_y) / period)
        for number, ((x, y, _), (old_x, old_y, _)) in enumerate(
            zip(now.people, before.people, strict=True)
        )
        if not (isnan(x) or isnan(old_x))
    }


def _contact(before: _Moment, person: int, velocity: Velocity) -> PeopleContact:
    """Return the contact that follows a moment with a person who moves at a velocity."""
    pose, twist = before.pose, before.twist
    x, y, _ = before.people[person]
    x, y = x - pose.x, y - pose.y
    away = max(hypot(x, y), 1e-9)
    x, y = x / away, y / away
    c, s = cos(pose.heading), sin(pose.heading)
    own = (c * twist.linear - s * twist.lateral) * x + (s * twist.linear + c * twist.lateral) * y
    theirs = -velocity[0] * x - velocity[1] * y
    turns = hypot(twist.linear, twist.lateral) <= TOWARDS < abs(twist.angular)
    return PeopleContact(before.time, own, theirs, turns)
