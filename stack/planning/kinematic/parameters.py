"""Parameters shared by the pose planners."""

from __future__ import annotations

from dataclasses import dataclass

from stack.parameters import parameter
from stack.planning.parameters import PlannerParameters
from stack.planning.smoothers.choice import SMOOTHERS


@dataclass(frozen=True)
class PosePlannerParameters(PlannerParameters):
    """Parameters of a search over poses."""

    max_expansions: int = parameter(
        1_000_000, at_least=1, at_most=100_000_000,
        help="maximum number of expanded poses; the limit is the same on every machine",
    )  # fmt: skip
    cost_weight: float = parameter(
        3.0, at_least=0.0, at_most=50.0, public=True,
        help="weight of cell costs: a path costs length * (1 + cost_weight * cost / 252)",
    )  # fmt: skip
    reverse_penalty: float = parameter(
        2.0, at_least=1.0, at_most=50.0, public=True, help="cost factor for driving backward"
    )
    analytic_ratio: float = parameter(
        3.5, above=0.0, at_most=100.0,
        help="interval of the analytic expansions relative to the remaining distance; "
        "higher: more often",
    )  # fmt: skip
    smoother: str = parameter(
        "constrained", one_of=SMOOTHERS, public=True, help="smoother for the path between cusps"
    )
