"""A way that is open on the map is closed: by a door, or by something that is not on the map."""

from __future__ import annotations

from collections.abc import Sequence

from missions.inspection.causes.cause import CERTAIN, SYMPTOM, Cause, Fact, share
from missions.inspection.causes.costmaps import ROOM, ground_of, reachable_area
from missions.inspection.causes.evidence import Evidence
from missions.inspection.page.blockers import Person, person_at
from stack.costmap.closed_way import closed_way
from stack.costmap.closing_zones import zone_words
from stack.types import FailureCode


def passage_closed(evidence: Evidence) -> Cause | None:
    """There is no path, although the map has one."""
    grid, shot = evidence.costmap("global_costmap"), evidence.before
    if grid is None or shot.goal is None or evidence.code != FailureCode.NO_VALID_PATH:
        return None
    if zones := _closing_zones(evidence):
        return _closed_by_zones(evidence, zones)
    found = closed_way(
        grid, ground_of(evidence, grid), shot.pose, shot.goal, evidence.inscribed_radius
    )
    if found is None:
        return _no_way(evidence)
    marks = evidence.landmarks
    if person := person_at(shot, found.at, evidence.facts.people):
        return _closed_by_person(evidence, person)
    at = _told_place(evidence) or found.at
    door = marks.door_at(at)
    moved = [
        event for event in evidence.told("door")
        if door is not None and event.fields.get("door") == door.name
    ]  # fmt: skip
    facts = (
        Fact(f"the map has a way of {found.length:.1f} m to {marks.name(shot.goal)}, closed after "
             f"{found.open_length:.1f} m", evidence.end),
        *(Fact(event.text, event.time) for event in moved[-1:]),
    )  # fmt: skip
    advice = "wait for it (`retry` with a delay), take another way, or ask for help with `say`"
    if door is None:
        advice += "; if it is always there, draw it into the map"
    return Cause(
        "passage closed", CERTAIN * evidence.trust * share(reachable_area(grid, shot.pose), ROOM),
        marks.closed(at),
        facts, advice,
    )  # fmt: skip


def _closing_zones(evidence: Evidence) -> list[str]:
    """Return the keep-out zones that closed the way of the failed drive."""
    told = evidence.told("closed", evidence.begin)
    return [str(name) for name in told[-1].fields.get("zones", ())] if told else []


def _closed_by_zones(evidence: Evidence, zones: Sequence[str]) -> Cause:
    event = evidence.told("closed")[-1]
    return Cause(
        "passage closed", CERTAIN, f"{zone_words(zones)} closed the way",
        (Fact(event.text, event.time),),
        "move the zone or the goal, or take another way",
    )  # fmt: skip


def _no_way(evidence: Evidence) -> Cause:
    shot = evidence.before
    facts = (
        Fact("the map without sensed obstacles has no way either, for a robot of this width",
             evidence.end, (shot.pose.x, shot.pose.y)),
    )  # fmt: skip
    return Cause(
        "no way on the map", SYMPTOM * evidence.trust, "the map itself has no way to the goal",
        facts,
        "look for the narrowest passage with `treepilot doctor`; move the goal, or correct the map",
    )  # fmt: skip


def _told_place(evidence: Evidence) -> tuple[float, float] | None:
    """Return where navigation found the way of the failed drive closed; None if it did not."""
    told = [event.fields.get("place") for event in evidence.told("closed", evidence.begin)]
    return (float(told[-1][0]), float(told[-1][1])) if told and told[-1] else None


def _closed_by_person(evidence: Evidence, person: Person) -> Cause:
    who = person.words
    return Cause(
        "held by a person", CERTAIN * evidence.trust,
        f"{who} stands in the way at {evidence.landmarks.where((person.x, person.y))}",
        (Fact(f"the map has a way; {who} closes it", evidence.end),),
        "wait for them (`retry` with a delay), take another way, or ask with `say`",
    )  # fmt: skip


CAUSES = (passage_closed,)
