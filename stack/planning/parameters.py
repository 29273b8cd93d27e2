"""What planners have in common to be set."""

from __future__ import annotations

from dataclasses import dataclass

from stack.parameters import parameter


@dataclass(frozen=True)
class PlannerParameters:
    """Tolerances and limits that every planner has."""

    allow_unknown: bool = parameter(True, help="plan through cells nobody has seen")
    tolerance: float = parameter(
        0.2, "m", at_least=0.0, at_most=5.0,
        help="when the goal cannot be reached, a place this near will do; 0 is exactly there",
    )  # fmt: skip
    escape_distance: float = parameter(
        0.3, "m", at_least=0.0, at_most=2.0,
        help="how far a plan may lead out of a place too near to an obstacle",
    )  # fmt: skip
    allow_partial: bool = parameter(
        False, help="when the goal cannot be reached, lead as near to it as can be"
    )
    max_expansions: int = parameter(
        100_000_000, at_least=1, at_most=1_000_000_000,
        help="places looked at before it gives up: a limit that is the same on every machine",
    )  # fmt: skip
