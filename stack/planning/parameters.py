"""Parameters that all grid and pose planners share."""

from __future__ import annotations

from dataclasses import dataclass

from stack.parameters import parameter


@dataclass(frozen=True)
class PlannerParameters:
    """Tolerances and limits of a planner."""

    allow_unknown: bool = parameter(True, public=True, help="plan through unknown cells")
    tolerance: float = parameter(
        0.2, "m", at_least=0.0, at_most=5.0, public=True,
        help="if the goal cannot be reached, accept a place within this distance; 0: exact goal",
    )  # fmt: skip
    escape_distance: float = parameter(
        0.3, "m", at_least=0.0, at_most=2.0,
        help="longest distance to leave a start that is too close to an obstacle",
    )  # fmt: skip
    allow_partial: bool = parameter(
        False, public=True,
        help="if the goal cannot be reached, plan to the nearest reachable place",
    )  # fmt: skip
    max_expansions: int = parameter(
        100_000_000, at_least=1, at_most=1_000_000_000,
        help="maximum number of expanded cells; the limit is the same on every machine",
    )  # fmt: skip
