"""Parameters shared by the pose planners, and limits that follow from the robot."""

from __future__ import annotations

from dataclasses import dataclass

from stack.drivetrain.description import RobotDescription
from stack.errors import InputError
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


def radius_for(robot: RobotDescription, requested: float | None, default: float) -> float:
    """Return the minimum turning radius of a path, metres.

    Args:
        robot: the robot that follows the path.
        requested: the parameter `turning_radius`; None for the robot's own.
        default: default for robots that can turn in place.

    Raises:
        InputError: `requested` is below the robot's turning radius.
    """
    least = robot.turning_radius
    if requested is None:
        return least or default
    if requested < least - 1e-9:
        raise InputError(
            f"turning_radius: {requested:g} m is below the turning radius of {robot.name}, "
            f"{least:.3g} m; leave the parameter out to use the robot's own"
        )
    return requested


def may_reverse(robot: RobotDescription) -> bool:
    """Return whether the robot can drive backward."""
    return robot.limits.reverse_speed > 0.0
