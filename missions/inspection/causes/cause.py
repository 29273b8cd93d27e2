"""A likely cause of a failure, and the facts that speak for it."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

CERTAIN, SYMPTOM, LEAST = 0.95, 0.8, 0.25
"""Strength of a cause that the records show directly; of one that another cause may have brought
about, such as being lost or held; and below which a cause is not listed."""


@dataclass(frozen=True, slots=True)
class Fact:
    """A piece of evidence.

    Attributes:
        text: figures with their units.
        time: robot time, seconds; None: of the whole run.
        at: (x, y) in the map frame, metres; None: nowhere.
    """

    text: str
    time: float | None = None
    at: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class Cause:
    """A likely cause of what went wrong.

    Attributes:
        name: a stable word for programs.
        strength: in [0, 1], the share of the failure that the evidence explains: of the time lost,
            of the way closed, of the distance not driven… CERTAIN where a record names the cause.
        sentence: what happened.
        facts: the evidence, the strongest first.
        advice: what to do.
    """

    name: str
    strength: float
    sentence: str
    facts: tuple[Fact, ...]
    advice: str

    def plain(self) -> dict[str, Any]:
        """Return JSON-compatible values."""
        return asdict(self)


def share(part: float, whole: float) -> float:
    """Return a part of a whole, in [0, 1]; 0 of nothing."""
    return min(1.0, max(0.0, part / whole)) if whole > 0.0 else 0.0
