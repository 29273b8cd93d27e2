"""Checks of a robot: what was found, and the remedy of what is wrong."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Any, Literal

Outcome = Literal["passed", "failed", "skipped"]


@dataclass(frozen=True, slots=True)
class Check:
    """One check.

    Attributes:
        name: what is checked, e.g. `lidar rate`.
        outcome: a skipped check says nothing about the robot.
        found: what was measured, with the number that was expected.
        remedy: what to do; empty unless the check failed.
    """

    name: str
    outcome: Outcome
    found: str
    remedy: str = ""


def passed(name: str, found: str) -> Check:
    """Return a check that passed."""
    return Check(name, "passed", found)


def failed(name: str, found: str, remedy: str) -> Check:
    """Return a check that failed."""
    return Check(name, "failed", found, remedy)


def skipped(name: str, why: str) -> Check:
    """Return a check that was not made."""
    return Check(name, "skipped", why)


def judged(name: str, is_right: bool, found: str, remedy: str) -> Check:
    """Return a check by its result."""
    return passed(name, found) if is_right else failed(name, found, remedy)


@dataclass(frozen=True, slots=True)
class Preflight:
    """All checks of a robot, in the order in which they were made."""

    robot: str
    checks: tuple[Check, ...]

    @property
    def failures(self) -> tuple[Check, ...]:
        """The checks that failed."""
        return failures(self.checks)

    def plain(self) -> dict[str, Any]:
        """Return the result for JSON."""
        return {
            "robot": self.robot,
            "passed": not self.failures,
            "checks": [asdict(check) for check in self.checks],
        }


def failures(checks: Iterable[Check]) -> tuple[Check, ...]:
    """Return the checks that failed."""
    return tuple(check for check in checks if check.outcome == "failed")
