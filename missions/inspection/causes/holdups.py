"""Causes in what stood in the way: people, obstacles, safety zones."""

from __future__ import annotations

from missions.inspection.causes.cause import CERTAIN, SYMPTOM, Cause, Fact
from missions.inspection.causes.evidence import Evidence
from stack.types import FailureCode
from stack.types.limitations import (
    BLIND_SECTOR,
    NOT_FINITE,
    OBSTACLE,
    PERSON,
    SPEED_LIMIT,
    UNSEEN_GROUND,
    ZONE,
)

THINGS = (OBSTACLE, ZONE, BLIND_SECTOR, UNSEEN_GROUND, SPEED_LIMIT, NOT_FINITE)
"""What can hold a robot besides people, old measurements, operators and doubt."""


def held_by_person(evidence: Evidence) -> Cause | None:
    """A person was in the way."""
    held = evidence.held_share(PERSON)
    certain = evidence.code == FailureCode.BLOCKED_BY_PERSON
    if not certain and not held:
        return None
    return Cause(
        "held by a person", CERTAIN if certain else CERTAIN * held,
        f"{_who(evidence)} was in the way", _facts(evidence, PERSON),
        "let it wait longer (`navigator.person_patience`), take another route, or ask the person: "
        "`say` in a recovery",
    )  # fmt: skip


def held_by_obstacle(evidence: Evidence) -> Cause | None:
    """An obstacle or a safety zone held the robot."""
    cause = max(THINGS, key=evidence.held_share)
    held = evidence.held_share(cause)
    ahead = evidence.code == FailureCode.COLLISION_AHEAD
    if not ahead and not held:
        return None
    cause = cause if held else OBSTACLE
    return Cause(
        "held by an obstacle" if cause == OBSTACLE else f"held by {cause}",
        SYMPTOM * (1.0 if ahead else held), f"the robot was held: {_detail(evidence, cause)}",
        _facts(evidence, cause),
        "look at what is there with `treepilot replay`; leave it more room, or change the zone or "
        "limit that holds the robot (`treepilot parameters MISSION safety`)",
    )  # fmt: skip


def _who(evidence: Evidence) -> str:
    """Return the names of the people who held the robot."""
    names = dict.fromkeys(one.name for one in evidence.story.blockers if one.door is None)
    return " and ".join(name for name in names if name != PERSON) or "a person"


def _detail(evidence: Evidence, cause: str) -> str:
    """Return the newest words of a cause."""
    every = (one for shot in reversed(evidence.shots) for one in shot.limitations)
    return next((one.detail for one in every if one.cause == cause), cause)


def _facts(evidence: Evidence, cause: str) -> tuple[Fact, ...]:
    told = [event for event in evidence.told("held") if event.fields.get("cause") == cause]
    found = [Fact(event.text, event.time) for event in told[-3:]]
    found += evidence.held_facts(cause)
    failed = evidence.failed
    return tuple(found or ([] if failed is None else [Fact(failed.message, failed.time)]))


CAUSES = (held_by_person, held_by_obstacle)
