"""Doors and people that blocked the robot, for the map of a report."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from math import hypot, inf

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
class Blocker:
    """A closed door, or a person, that blocked the robot.

    Attributes:
        name: of the door or person.
        at: place of the person, or of the door where it blocked, map frame, metres.
        times: robot times of the events that tell it, seconds, ascending.
        door: its ends; None: a person.
    """

    name: str
    at: tuple[float, float]
    times: tuple[float, ...]
    door: Doorway | None = None

    @property
    def label(self) -> list[str]:
        """Lines of its mark, as in: fire_door closed / 10.2 s, 13.7 s, …"""
        times = ", ".join(f"{time:.1f} s" for time in self.times[:2])
        rest = ", …" if len(self.times) > 2 else ""
        return [f"{self.name} closed" if self.door else self.name, f"{times}{rest}"]


def blockers_of(
    events: Iterable[Event], recording: SnapshotRecording, facts: PlanFacts
) -> tuple[Blocker, ...]:
    """Return the doors and people that blocked the robot, in order of their first times.

    People have names in a simulation whose records tell them; others are called `person`.
    """
    marks, found = Landmarks(doors=facts.doors), list[Blocker]()
    shut: set[object] = set()
    for event in events:
        if event.kind == "door":
            (shut.add if event.fields.get("closed") else shut.discard)(event.fields.get("door"))
        if event.kind not in ("held", "closed"):
            continue
        at = _point(event.fields.get("place"))
        door = None if at is None else marks.door_at(at)
        if at and door and (event.kind == "closed" or door.name in shut):
            _add(found, Blocker(door.name, at, (event.time,), door))
        else:
            shot = recording.snapshot(recording.index_at(event.time), whole=False)
            by_person = event.fields.get("cause") == PERSON
            _add(found, _person(at, event.time, shot, facts.people, by_person=by_person))
    return tuple(found)


def _add(found: list[Blocker], blocker: Blocker | None) -> None:
    """Add a blocker, or its time to the same one before."""
    if blocker is None:
        return
    for number, one in enumerate(found):
        if one.name == blocker.name and _is_same(one, blocker):
            times = one.times if one.times[-1] == blocker.times[0] else one.times + blocker.times
            found[number] = replace(one, times=times)
            return
    found.append(blocker)


def _is_same(one: Blocker, other: Blocker) -> bool:
    away = hypot(one.at[0] - other.at[0], one.at[1] - other.at[1])
    return one.door == other.door and (one.door is not None or away <= SAME_PLACE)


def _person(
    at: tuple[float, float] | None, time: float, shot: Snapshot, names: tuple[str, ...],
    *, by_person: bool,
) -> Blocker | None:  # fmt: skip
    """Return the person at a place; without one, the nearest to a robot that waits for a person."""
    if at is None and not by_person:
        return None
    x, y = at or (shot.pose.x, shot.pose.y)
    gaps = [(hypot(px - x, py - y) - r, name, px, py) for name, px, py, r in _people(shot, names)]
    gap, name, px, py = min(gaps, default=(inf, PERSON, x, y))
    if gap <= (AT_PERSON if at else NEAR_ROBOT):
        return Blocker(name, (px, py), (time,))
    return Blocker(PERSON, at, (time,)) if at and by_person else None


def _people(shot: Snapshot, names: tuple[str, ...]) -> list[tuple[str, float, float, float]]:
    """Return name, x, y and radius of the people of the simulation; without one, of the tracks."""
    if shot.people is None:
        return [(PERSON, *track.position, track.radius) for track in shot.tracks]
    known = names if len(names) == len(shot.people) else [PERSON] * len(shot.people)
    return [
        (name, x, y, radius)
        for name, (x, y, radius) in zip(known, shot.people.tolist(), strict=True)
    ]


def _point(place: object) -> tuple[float, float] | None:
    """Return the place of an event; None if there is none, or another version wrote another."""
    match place:
        case [int() | float() as x, int() | float() as y]:
            return float(x), float(y)
    return None
