"""A likely cause of a failure, and the facts that speak for it."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from math import inf
from typing import Any

CERTAIN, SYMPTOM, LEAST = 0.95, 0.8, 0.25
"""Strength of a cause that the records show directly; of one that another cause may have brought
about, such as being lost or held; and below which a cause is not listed."""


AT, TRULY, BELIEVED = "at", "truly at", "believed to be at"
"""Words before a place on the map: of a thing; of the robot by the simulation; by its estimate."""


@dataclass(frozen=True, slots=True)
class Fact:
    """A piece of evidence.

    Attributes:
        text: figures with their units.
        time: robot time, seconds; None: of the whole run.
        at: (x, y) in the map frame, metres; None: nowhere.
        how: words before the place: AT, or TRULY or BELIEVED of the robot's own place.
    """

    text: str
    time: float | None = None
    at: tuple[float, float] | None = None
    how: str = AT


@dataclass(frozen=True, slots=True)
class Cause:
    """A likely cause of what went wrong.

    Attributes:
        name: a stable word for programs.
        strength: in [0, 1], the share of the failure that the evidence explains: of the time lost,
            of the way closed, of the distance not driven… CERTAIN where a record names the cause.
        sentence: what happened.
        facts: the evidence, in order of time, then what is about the whole run.
        advice: what to do.
    """

    name: str
    strength: float
    sentence: str
    facts: tuple[Fact, ...]
    advice: str

    @property
    def is_sure(self) -> bool:
        """Whether nothing else can have brought about what the evidence shows."""
        return self.strength > SYMPTOM

    def plain(self) -> dict[str, Any]:
        """Return JSON-compatible values."""
        return asdict(self)


def in_order(cause: Cause) -> Cause:
    """Return a cause with its facts in order of time."""
    return replace(cause, facts=tuple(sorted(
        cause.facts, key=lambda fact: inf if fact.time is None else fact.time
    )))  # fmt: skip


def share(part: float, whole: float) -> float:
    """Return a part of a whole, in [0, 1]; 0 of nothing."""
    return min(1.0, max(0.0, part / whole)) if whole > 0.0 else 0.0
