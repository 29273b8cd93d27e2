"""Names that users write: the most similar known one, and names that have changed."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from difflib import get_close_matches

RENAMED = {
    "localisation.quality": "localisation.health",
    "lost_quality": "lost_health",
    "min_quality": "min_health",
    "quality_window": "health_window",
    "goal_position": "stop_distance",
    "goal_heading": "turn_precision",
}
"""Renamed names of mission and parameter files: old -> new (CHANGELOG.md)."""

MOVED = {
    "goal_position": "goal_checker: {position: …}",
    "goal_heading": "goal_checker: {heading: …}",
    "goal_settle": "goal_checker: {settle: …}",
    "progress_distance": "progress_checker: {distance: …}",
    "progress_angle": "progress_checker: {angle: …}",
    "progress_time": "progress_checker: {time: …}",
    "lost_health": "localisation: {use: mcl, lost_health: …}",
    "patience": "navigator: {replan_patience: …}",
}
"""Parameters that belong to another component now: old name -> what to write."""


NONE = "none are available"


def suggestion(word: str, known: Iterable[str]) -> str:
    """Hint for an unknown word: its new name, the most similar word, or all known words."""
    names = sorted(set(known))
    return likely(word, names) or (f"available: {', '.join(names)}" if names else NONE)


def likely(word: str, known: Iterable[str]) -> str:
    """Hint for an unknown word: its new name or the most similar word; "" if none is similar."""
    names = sorted(known)
    if RENAMED.get(word) in names:
        return f"{word!r} was renamed to {RENAMED[word]!r}"
    close = nearest(word, names)
    return "" if close is None else f"did you mean {close!r}?"


def nearest(word: str, known: Sequence[str]) -> str | None:
    """The known name most similar to a misspelt word; None if none is similar.

    A unique prefix takes precedence: `init` gives `initial`, not `unit`.
    """
    longer = [name for name in known if len(word) > 2 and name.startswith(word)]
    if len(longer) == 1:
        return longer[0]
    return next(iter(get_close_matches(word, sorted(known), n=1, cutoff=0.6)), None)
