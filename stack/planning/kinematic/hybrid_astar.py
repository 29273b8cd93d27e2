"""Hybrid A* planner: paths for vehicles with a minimum turning radius."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import pi
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from stack.compilation import KernelTypes
from stack.drivetrain.description import RobotDescription
from stack.errors import InputError
from stack.parameters import parameter
from stack.planning.kinematic.moves import HEADINGS, Penalties, pack_moves, steering_moves
from stack.planning.kinematic.parameters import PosePlannerParameters
from stack.planning.kinematic.planning import PosePlanner
from stack.planning.kinematic.search import SearchMethod
from stack.planning.kinematic.shortcuts import CurveShortcut

_TABLE_REACH, _TABLE_STEP, _TABLE_TURNS = 16, 0.25, 36  # cells to a side; radii; headings
_RADIUS = 0.4  # m, for robots that turn in place: tight, and smooth at walking speed
_TABLE_SLACK = 0.3  # radii by which rounding to the table's positions may lengthen a curve


@dataclass(frozen=True)
class HybridAstarParameters(PosePlannerParameters):
    """Parameters of hybrid A*. Names and meanings follow Nav2's SmacPlannerHybrid."""

    motion: str = parameter(
        "reeds_shepp", one_of=("dubins", "reeds_shepp"), public=True,
        help="dubins: forward only; reeds_shepp: also backward, if the robot can",
    )  # fmt: skip
    turning_radius: float | None = parameter(
        None, "m", above=0.0, at_most=50.0, public=True,
        help="minimum radius of the path; default: the robot's, 0.4 m if it turns in place",
    )  # fmt: skip
    non_straight_penalty: float = parameter(
        1.1, at_least=1.0, at_most=50.0, help="cost factor for arcs"
    )
    change_penalty: float = parameter(
        0.1, "m", at_least=0.0, at_most=50.0,
        help="cost of a change of driving direction or of steering side",
    )  # fmt: skip


class HybridAstar(PosePlanner):
    """Hybrid A*: collision-free path of poses for a vehicle with a minimum turning radius.

    D. Dolgov, S. Thrun, M. Montemerlo, J. Diebel, "Path Planning for Autonomous Vehicles in Unknown
    Semi-structured Environments", IJRR 2010: A* over cells of position and heading (72 bins), each
    with the continuous pose that reached it. The two heuristics are the cost to go of a point robot
    among the obstacles and the shortest curve without obstacles. Analytic expansions with such
    curves reach the goal exactly. Headings of the path are the robot's: in reverse they point
    against the motion.

    Args:
        parameters: motion, radius, penalties and tolerances.
        robot: its footprint stays clear of lethal cells, its base of inscribed ones; its turning
            radius and its reverse speed limit the path.

    Raises:
        InputError: the parameter `turning_radius` is below the robot's turning radius.
    """

    Parameters: ClassVar[type] = HybridAstarParameters
    parameters: HybridAstarParameters

    @staticmethod
    def check(parameters: HybridAstarParameters, robot: RobotDescription) -> None:
        """Raise InputError if `turning_radius` is below the robot's turning radius."""
        _radius_for(robot, parameters.turning_radius)

    @staticmethod
    def kernels(parameters: HybridAstarParameters, robot: RobotDescription) -> KernelTypes:
        from stack.planning.curves.kernels import DISTANCES

        return (*DISTANCES, *PosePlanner.kernels(parameters, robot))

    def __init__(self, parameters: HybridAstarParameters, robot: RobotDescription) -> None:
        p = parameters
        penalties = Penalties(p.reverse_penalty, p.non_straight_penalty, p.change_penalty)
        super().__init__(p, robot, _radius_for(robot, p.turning_radius), penalties)
        self._both_ways = p.motion == "reeds_shepp" and robot.limits.reverse_speed > 0.0

    def _new_method(self, resolution: float) -> SearchMethod:
        p, radius, both_ways = self.parameters, self._radius, self._both_ways
        moves = steering_moves(radius, resolution, both_ways)
        headings = np.linspace(0.0, 2.0 * pi, HEADINGS, endpoint=False)
        return SearchMethod(
            moves=pack_moves([moves] * HEADINGS, self._penalties, headings),
            shortcuts=(CurveShortcut(both_ways, radius, self._penalties),),
            table=_curve_lengths(both_ways) * np.float32(radius),
            table_step=_TABLE_STEP * radius,
            table_slack=_TABLE_SLACK * radius,
            ratio=p.analytic_ratio * moves[0].length,
            max_expansions=p.max_expansions,
            penalties=self._penalties,
        )


def _radius_for(robot: RobotDescription, requested: float | None) -> float:
    """Return the minimum turning radius of a path, metres.

    Args:
        robot: the robot that follows the path.
        requested: the parameter `turning_radius`; None for the robot's own.

    Raises:
        InputError: `requested` is below the robot's turning radius.
    """
    least = robot.turning_radius
    if requested is None:
        return least or _RADIUS
    if requested < least - 1e-9:
        raise InputError(
            f"turning_radius: {requested:g} m is below the turning radius of {robot.name}, "
            f"{least:.3g} m; leave the parameter out to use the robot's own"
        )
    return requested


@lru_cache(maxsize=2)
def _curve_lengths(both_ways: bool) -> NDArray[np.float32]:
    """Return the lengths of the shortest curves of radius 1; see `kernels.Target.table`."""
    from stack.planning.curves import kernels

    table: Any = kernels.distance_table
    lengths: NDArray[np.float32] = table(both_ways, _TABLE_REACH, _TABLE_STEP, _TABLE_TURNS)
    return lengths
