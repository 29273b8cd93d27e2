"""Findings about nodes that depend on where they run, and the values that they are about."""

from __future__ import annotations

from missions.language.values import Constant, Value
from stack.documents import Finding, Findings, Mark


class Claims:
    """Collects findings about nodes of trees that are used several times.

    A finding is reported only if it holds at every place where its node runs.
    """

    def __init__(self, findings: Findings) -> None:
        self.findings = findings
        self.found: dict[tuple[str, int], Finding | None] = {}

    def claim(self, finding: Finding | None, code: str, about: object) -> None:
        """Add one place: a finding, or None if the fault is absent there."""
        key = code, id(about)
        if finding is None:
            self.found[key] = None
        else:
            self.found.setdefault(key, finding)

    def report(self) -> None:
        """Report what holds everywhere."""
        self.findings.items += [item for item in self.found.values() if item is not None]


def number_of(value: Value | None) -> float | None:
    """Return a number that is known before the mission runs."""
    if isinstance(value, Constant) and isinstance(value.value, int | float):
        return value.value
    return None


def is_literal(value: Value | None) -> bool:
    """Return whether the file states the value itself, not the name of an argument."""
    return isinstance(value, Constant) and value.is_written


def mark_of(value: Value | None, otherwise: Mark) -> Mark:
    """Return the position of a value, if it is written in the file."""
    return value.mark if isinstance(value, Constant) and value.mark is not None else otherwise


def seconds(value: float) -> str:
    """Return a duration for sentences: 90 s, 5 min, 1 h."""
    for unit, length in (("h", 3600.0), ("min", 60.0)):
        if value >= length and value % length == 0.0:
            return f"{value / length:g} {unit}"
    return f"{value:g} s"
