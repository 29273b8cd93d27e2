"""Which of the tracked objects is the person who is followed.

A track keeps its id while it is seen; out of sight it is forgotten after a second, and the same
person gets another id. The person is therefore recognised by motion: where their velocity takes
them (constant velocities predict people well for a few seconds: C. Schöller et al., "What the
constant velocity model can teach us about pedestrian motion prediction", RA-L 2020), and by who
else was seen meanwhile. So is another person beside them.

Who has stopped out of sight has no track when the robot sees them again: tracks are of what moves.
They are supposed to be the standing object of their size that nobody has seen while they were in
sight (`KnownThings`), until they move, or somebody appears where they are more likely to be. A
track that jumps may have passed to another object, and is in doubt likewise until it moves.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from math import dist, exp, hypot

import numpy as np

from behaviours._people.known_things import KnownThings
from stack.types import StandingObject, TrackedObject

SURE_WITHIN = 0.3
"""Metres; a track whose position is more uncertain is out of sight."""

COASTING_TIME = 1.5
"""Seconds for which a person out of sight is expected to walk on."""

FIRST_REACH, REACH_SPEED, LONGEST_REACH = 0.8, 0.8, 4.0
"""Metres between the expected place and a new track that may be the person: at once, its growth in
m/s while out of sight, and its limit."""

TURNING, TURNING_TIME = 0.8, 5.0
"""Metres per m/s by which a velocity that differs from the person's makes a track less likely, and
seconds in which that loses weight: people rarely turn round while they are out of sight."""

WALKING, HURRY = 0.8, 1.3
"""m/s that everybody can walk, and how much faster than before a person may walk out of sight."""

STANDING_COST = 0.4
"""Metres by which a standing object is less likely the person than a walking person."""

JUMP_DISTANCE = 0.5
"""Metres from where the person is expected at which their track may be another object's."""

JUMP_PROVED = 0.4
"""Metres by which a track that has jumped moves if it is somebody's."""

MEMORY = 8.0
"""Seconds for which other people are remembered after they were seen."""

EXCHANGE_DISTANCE = 1.0
"""Metres between two people at which their tracks may be exchanged."""

LONGEST_MEETING = 8.0
"""Seconds of a meeting after which the courses before it tell nothing."""

DECISION_TIME = 1.5
"""Seconds after a meeting in which an exchange shows; the filters need some of them."""

EXCHANGED, CLEARLY = 0.7, 0.5
"""m/s by which a track's velocity has changed in a meeting if it is not the person's any more, and
the share of it by which each track may differ from the other's course before."""

VELOCITY_KNOWN_AFTER = 1.0
"""Seconds of a track after which the person's velocity is known."""

STANDING_SPEED = 0.15
"""m/s below which a person stands."""

SMOOTHING, COURSE = 0.4, 1.5
"""Seconds; time constants of the mean velocity, and of the course: people who meet step aside
before."""


@dataclass(slots=True)
class SeenPerson:
    """A person, as last seen, map frame.

    Attributes:
        id: of the track.
        stamp: seconds on the robot's clock.
        position: metres.
        velocity: mean of the last moments, m/s.
        course: mean velocity over a longer time, m/s.
    """

    id: int
    stamp: float
    position: tuple[float, float]
    velocity: tuple[float, float]
    course: tuple[float, float]

    @staticmethod
    def of(track: TrackedObject, now: float) -> SeenPerson:
        """Return a person seen for the first time."""
        return SeenPerson(track.id, now, track.position, track.velocity, track.velocity)

    def expected(self, now: float) -> tuple[float, float]:
        """Return where they are expected: they walk on for COASTING_TIME, then stand."""
        seconds = min(max(now - self.stamp, 0.0), COASTING_TIME)
        (x, y), (u, v) = self.position, self.velocity
        return x + seconds * u, y + seconds * v

    def renew(self, track: TrackedObject, now: float) -> None:
        """Take over what is seen now."""
        seconds = max(now - self.stamp, 0.0)
        self.velocity = _mean(self.velocity, track.velocity, exp(-seconds / SMOOTHING))
        self.course = _mean(self.course, track.velocity, exp(-seconds / COURSE))
        self.id, self.stamp, self.position = track.id, now, track.position


@dataclass(slots=True)
class _Meeting:
    """Another person came near at a time; the courses of both before, and when they parted."""

    began: float
    course: tuple[float, float]
    other: int
    other_course: tuple[float, float]
    parted: float | None = None


class FollowedPerson:
    """The person who is followed, and who else is around.

    Args:
        track: of the person.
        now: seconds on the robot's clock.

    Attributes:
        seen: the person when last seen.
        radius: of the person, metres.
        visible: whether the person is seen now.
        times_lost: how often the track ended.
        is_supposed: whether the person may be this object, which has not moved yet.
    """

    def __init__(self, track: TrackedObject, now: float) -> None:
        self.seen = SeenPerson.of(track, now)
        self.radius, self.visible, self.times_lost = track.radius, True, 0
        self.is_supposed = False
        self._walk, self._things, self._cost = SeenPerson.of(track, now), KnownThings(now), 0.0
        self._jumped_to: tuple[float, float] | None = None
        self._others: dict[int, SeenPerson] = {}
        self._meeting: _Meeting | None = None
        self._is_tracked, self._tracked_since = True, now

    @property
    def stands(self) -> bool:
        """Whether the person stood when last seen."""
        return hypot(*self.seen.velocity) < STANDING_SPEED

    def expected(self, now: float) -> tuple[float, float]:
        """Return where the person is, or is expected to be; map frame, metres."""
        return self.seen.expected(now)

    def update(
        self, tracks: Sequence[TrackedObject], now: float,
        standing: Sequence[StandingObject] = (),
    ) -> None:  # fmt: skip
        """Look for the person among the tracks and the standing objects of this moment.

        Args:
            tracks: of what moves, map frame.
            now: seconds on the robot's clock.
            standing: objects that have not moved, map frame.
        """
        by_id = {track.id: track for track in tracks}
        own = by_id.get(self._exchanged(by_id, now))
        if own is not None:
            self._note_jump(own, now)
        if own is None or self._jumped_to is not None:
            own = self._found_again(tracks, standing, now)
        if own is None or own.id != self.seen.id:
            self._jumped_to = None
        if self._is_tracked and own is None:
            self.times_lost += 1
        if own is not None and not self._is_tracked:
            self._tracked_since, self._meeting = now, None
        self._is_tracked = own is not None
        self.is_supposed = own is not None and (own.id not in by_id or self._jumped_to is not None)
        self.visible = own is not None and deviation(own) <= SURE_WITHIN
        if own is not None:
            self._take(own, now)
        self._note_others((track for track in tracks if track is not own), now)
        if self.visible and not self.is_supposed:
            self._things.note(standing, self.seen.position)

    def _note_jump(self, own: TrackedObject, now: float) -> None:
        """Note that the person's track jumps, and that it moves again."""
        if self._jumped_to is not None:
            if dist(own.position, self._jumped_to) >= JUMP_PROVED:
                self._jumped_to = None
            return
        away = dist(own.position, self.seen.expected(now))
        if own.id == self.seen.id and deviation(own) <= SURE_WITHIN and away > JUMP_DISTANCE:
            self._jumped_to = own.position
            self._cost = _walking_cost(own, self._walk, now)

    def _take(self, own: TrackedObject, now: float) -> None:
        """Take over what is seen of the person."""
        self._others.pop(own.id, None)
        if not self.visible:
            self.seen.id = own.id
            return
        self.seen.renew(own, now)
        if not self.is_supposed:
            self.radius, self._walk = own.radius, replace(self.seen)

    def _note_others(self, tracks: Iterable[TrackedObject], now: float) -> None:
        """Remember who is seen beside the person; note who meets the person.

        Who appears while the person is out of sight may be the person.
        """
        nearest, gap = None, EXCHANGE_DISTANCE
        for track in tracks:
            if deviation(track) > SURE_WITHIN:
                continue
            other = self._others.get(track.id)
            if other is not None:
                other.renew(track, now)
            elif self.visible:
                self._others[track.id] = SeenPerson.of(track, now)
            away = dist(track.position, self.expected(now))
            if away < gap:
                nearest, gap = track.id, away
        self._others = {
            number: other for number, other in self._others.items() if now - other.stamp <= MEMORY
        }
        known = now - self._tracked_since >= VELOCITY_KNOWN_AFTER
        if nearest in self._others and known and self._meeting is None:
            other = self._others[nearest]
            self._meeting = _Meeting(now, self.seen.course, nearest, other.course)

    def _exchanged(self, by_id: dict[int, TrackedObject], now: float) -> int:
        """Return the id of the person's track: another one if a meeting has exchanged two.

        After a meeting people walk on as before. If each of the two tracks now walks as the other
        one did before, they have been exchanged.
        """
        own, meeting = by_id.get(self.seen.id), self._meeting
        if meeting is None:
            return self.seen.id
        parted = meeting.parted is not None and now - meeting.parted > DECISION_TIME
        if parted or now - meeting.began > LONGEST_MEETING:
            self._meeting = None
            return self.seen.id
        other = by_id.get(meeting.other)
        if own is None or other is None:
            return self.seen.id
        if dist(own.position, other.position) < EXCHANGE_DISTANCE:
            meeting.parted = None
            return self.seen.id
        if meeting.parted is None:
            meeting.parted = now
        changed = dist(own.velocity, meeting.course)
        crossed = (
            dist(other.velocity, meeting.course), dist(own.velocity, meeting.other_course)
        )  # fmt: skip
        if changed <= EXCHANGED or max(crossed) >= CLEARLY * changed:
            return own.id
        self._meeting = None
        self._others[own.id] = SeenPerson.of(own, now)
        return other.id

    def _found_again(
        self, tracks: Sequence[TrackedObject], standing: Sequence[StandingObject], now: float
    ) -> TrackedObject | None:
        """Return whose track is the person's if their own has ended; None without one."""
        last, least = self.seen, self._reach(now)
        best: TrackedObject | None = None
        if self.is_supposed or self._jumped_to is not None:
            best = next((item for item in (*tracks, *standing) if item.id == last.id), None)
        if best is not None:  # unless somebody is where the person is more likely to be
            last, least = self._walk, self._cost
        present = {track.id for track in tracks}
        gone = [other for number, other in self._others.items() if number not in present]
        costs: list[tuple[float, TrackedObject]] = [
            (_walking_cost(track, last, now), track)
            for track in tracks if track.id not in self._others and track is not best
        ]  # fmt: skip
        costs += [
            (_standing_cost(item, last, now), item)
            for item in self._things.people(standing, self.radius) if item is not best
        ]  # fmt: skip
        for cost, track in costs:
            away = dist(track.position, last.expected(now))
            if any(dist(track.position, other.expected(now)) < away for other in gone):
                continue  # another person who was out of sight
            if cost <= least and _is_walkable(track, last, now):
                best, least = track, cost
        self._cost = least
        return best

    def _reach(self, now: float) -> float:
        """Return the highest cost of the person, metres."""
        return min(FIRST_REACH + REACH_SPEED * (now - self.seen.stamp), LONGEST_REACH)


def _walking_cost(track: TrackedObject, last: SeenPerson, now: float) -> float:
    """Return how far a track is from where the person is expected, and from their velocity."""
    stood = hypot(*last.velocity) < STANDING_SPEED
    turning = 0.0 if stood else TURNING * exp(-(now - last.stamp) / TURNING_TIME)
    away = dist(track.position, last.expected(now))
    return away + turning * dist(track.velocity, last.velocity)


def _standing_cost(item: StandingObject, last: SeenPerson, now: float) -> float:
    """Return how far an object is from the way that the person was expected to go on."""
    (x, y), (u, v) = last.position, last.expected(now)
    u, v = u - x, v - y
    dx, dy = item.position[0] - x, item.position[1] - y
    share = min(max((dx * u + dy * v) / max(u * u + v * v, 1e-9), 0.0), 1.0)
    return STANDING_COST + hypot(dx - share * u, dy - share * v)


def _is_walkable(track: TrackedObject, last: SeenPerson, now: float) -> bool:
    """Whether the person can have come there since they were seen."""
    speed = max(WALKING, HURRY * hypot(*last.velocity))
    return dist(track.position, last.position) <= FIRST_REACH + speed * (now - last.stamp)


def deviation(track: TrackedObject) -> float:
    """Return the standard deviation of a track's position in its worst direction, metres."""
    return float(np.sqrt(max(0.0, np.linalg.eigvalsh(track.covariance[:2, :2])[-1])))


def _mean(
    before: tuple[float, float], now: tuple[float, float], keep: float
) -> tuple[float, float]:
    """Return an exponential mean with a share of what was before."""
    return keep * before[0] + (1.0 - keep) * now[0], keep * before[1] + (1.0 - keep) * now[1]
