"""What the planners of poses have in common to be set, and what the robot has to say to it."""

from __future__ import annotations

from dataclasses import dataclass

from stack.drivetrain.description import RobotDescription
from stack.errors import InputError
from stack.parameters import parameter
from stack.planning.parameters import PlannerParameters
from stack.planning.smoothers.choice import SMOOTHERS


@dataclass(frozen=True)
class PosePlannerParameters(PlannerParameters):
    """How a search over poses weighs its moves."""

    max_expansions: int = parameter(
        500_000, at_least=1, at_most=100_000_000,
        help="poses looked at before it gives up: a limit that is the same on every machine",
    )  # fmt: skip
    cost_weight: float = parameter(
        3.0, at_least=0.0, at_most=50.0,
        help="how many times its length a way costs more where the costmap is fullest (252)",
    )  # fmt: skip
    reverse_penalty: float = parameter(
        2.0, at_least=1.0, at_most=50.0, help="a metre backward counts this many"
    )
    analytic_ratio: float = parameter(
        3.5, above=0.0, at_most=100.0,
        help="tries to reach the goal in one go this often as it comes nearer",
    )  # fmt: skip
    smoother: str = parameter(
        "constrained", one_of=SMOOTHERS, help="what is done to the path between cusps"
    )


def radius_for(robot: RobotDescription, asked: float | None, usual: float) -> float:
    """The least radius of a path's arcs, metres.

    Args:
        robot: who is to drive them.
        asked: what the parameter `turning_radius` says; None is the robot's own.
        usual: for robots that can turn in place, which have none.

    Raises:
        InputError: asked is a tighter circle than the robot can drive.
    """
    least = robot.turning_radius
    if asked is None:
        return least or usual
    if asked < least - 1e-9:
        raise InputError(
            f"turning_radius: {asked:g} m is tighter than {robot.name} can drive, {least:.3g} m; "
            "leave the parameter out to plan with the robot's own"
        )
    return asked


def may_reverse(robot: RobotDescription) -> bool:
    """Whether paths may lead backward at all."""
    return robot.limits.reverse_speed > 0.0
