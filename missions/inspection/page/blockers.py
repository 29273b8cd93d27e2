"""Doors and people that blocked the robot, for the map of a report."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import hypot

from missions.execution.records.plan_facts import PlanFacts
from stack.navigation.landmarks import Doorway, Landmarks
from stack.telemetry.records import Event, Snapshot
from stack.telemetry.snapshots.recording import SnapshotRecording
from stack.types.limitations import PERSON

AT_PERSON = 0.3
"""Metres from the body of a person within which what is there is the person."""

NEAR_ROBOT = 4.0
"""Metres from a robot that waits for a person within which it is the nearest person."""

SAME_PLACE = 0.5
"""Metres within which a person blocks the robot at the same place as before."""


@dataclass(frozen=True, slots=True)
class Person:
    """A person of the simulation, or a track: name, place in the map frame and radius, metres."""

    name: str
    x: float
    y: float
    radius: float

    @property
    def words(self) -> str:
        """The name; `a person` without one."""
        return f"a {PERSON}" if self.name == PERSON else self.name

    def gap_to(self, at: tuple[float, float]) -> float:
        """Metres from the body of the person to a point; negative inside."""
        return hypot(self.x - at[0], self.y - at[1]) - self.radius


@dataclass(frozen=True, slots=True)
class Blocker:
    """A closed door, or a person, that blocked the robot.

    Attributes:
        name: of the door or person.
        at: place of the person, or of the door where it blocked, map frame, metres.
        since: robot time at which the door closed, or from which on the person was there, seconds;
            None: not known.
        time: robot time at which it blocked the robot first, seconds.
        door: its ends; None: a person.
        radius: of the person, metres.
    """

    name: str
    at: tuple[float, float]
    since: float | None
    time: float
    door: Doorway | None = None
    radius: float = 0.0

    @property
    def label(self) -> list[str]:
        """Lines of its mark, as in: gate / closed at 1.7 s."""
        if self.since is None:
            return [self.name, f"in the way at {self.time:.1f} s"]
        words = "closed at" if self.door else "there from"
        return [self.name, f"{words} {self.since:.1f} s"]


def blockers_of(
    events: Iterable[Event], recording: SnapshotRecording, samples: Sequence[Snapshot],
    facts: PlanFacts,
) -> tuple[Blocker, ...]:  # fmt: skip
    """Return the doors and people that blocked the robot, in order of their first times.

    People have names in a simulation whose records tell them; others are called `person`.

    Args:
        events: of the run.
        recording: of the run.
        samples: snapshots of the whole run, in order: since when a person is at a place.
        facts: names of doors and people.
    """
    marks, found = Landmarks(doors=facts.doors), list[Blocker]()
    shut: dict[object, float] = {}
    for event in events:
        if event.kind == "door":
            shut.pop(event.fields.get("door"), None)
            if event.fields.get("closed"):
                shut[event.fields.get("door")] = event.time
        if event.kind not in ("held", "closed"):
            continue
        at = _point(event.fields.get("place"))
        door = None if at is None else marks.door_at(at)
        blocker: Blocker | None = None
        if at and door and (event.kind == "closed" or door.name in shut):
            blocker = Blocker(door.name, at, shut.get(door.name), event.time, door)
        elif at or event.fields.get("cause") == PERSON:
            shot = recording.snapshot(recording.index_at(event.time), whole=False)
            by_person = event.fields.get("cause") == PERSON
            if person := _person(at, shot, facts.people, by_person=by_person):
                known = shot.people is not None and person.radius > 0.0
                since = _since(samples, event.time, person, facts.people) if known else None
                place = person.x, person.y
                blocker = Blocker(person.name, place, since, event.time, radius=person.radius)
        if blocker is not None and not any(_is_same(one, blocker) for one in found):
            found.append(blocker)
    return tuple(found)


def people_in(shot: Snapshot, names: Sequence[str]) -> list[Person]:
    """Return the people of the simulation, and those that the robot tracks.

    Args:
        shot: a snapshot.
        names: of the people of the simulation, as far as the records tell them.
    """
    places = [] if shot.people is None else shot.people.tolist()
    known = names if len(names) == len(places) else [PERSON] * len(places)
    tracked = [Person(PERSON, *track.position, track.radius) for track in shot.tracks]
    return [*(Person(name, *row) for name, row in zip(known, places, strict=True)), *tracked]


def person_at(
    shot: Snapshot, at: tuple[float, float], names: Sequence[str], within: float = AT_PERSON
) -> Person | None:
    """Return who is within some metres of a place: the nearest, if possible one with a name."""
    near = [one for one in people_in(shot, names) if one.gap_to(at) <= within]
    return min(near, key=lambda one: (one.name == PERSON, one.gap_to(at)), default=None)


def _is_same(one: Blocker, other: Blocker) -> bool:
    away = hypot(one.at[0] - other.at[0], one.at[1] - other.at[1])
    same = one.name == other.name and one.door == other.door
    return same and (one.door is not None or away <= SAME_PLACE)


def _person(
    at: tuple[float, float] | None, shot: Snapshot, names: Sequence[str], *, by_person: bool
) -> Person | None:
    """Return the person at a place; without one, the nearest to a robot that waits for a person.

    Of a person whom nothing shows only the place is known: the radius is 0.
    """
    here = at or (shot.pose.x, shot.pose.y)
    found = person_at(shot, here, names, AT_PERSON if at else NEAR_ROBOT)
    return found or (Person(PERSON, *at, 0.0) if at and by_person else None)


def _since(samples: Sequence[Snapshot], time: float, person: Person, names: Sequence[str]) -> float:
    """Return from which time on, up to a time, a person of the simulation has been at a place."""
    since = time
    for shot in reversed(samples):
        if shot.time > time:
            continue
        people = people_in(shot, names)
        if not any(hypot(one.x - person.x, one.y - person.y) <= SAME_PLACE for one in people):
            break
        since = shot.time
    return since


def _point(place: object) -> tuple[float, float] | None:
    """Return the place of an event; None if there is none, or another version wrote another."""
    match place:
        case [int() | float() as x, int() | float() as y]:
            return float(x), float(y)
    return None
