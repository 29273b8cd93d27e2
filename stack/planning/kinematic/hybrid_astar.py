"""Hybrid A*: paths that a vehicle with a turning circle can drive."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import pi
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from stack.description import RobotDescription
from stack.parameters import parameter
from stack.planning.endpoints import Endpoints
from stack.planning.kinematic.moves import HEADINGS, Prices, packed, steering_moves
from stack.planning.kinematic.planning import PosePlanning
from stack.planning.kinematic.search import Drive, Ground, Method
from stack.planning.kinematic.shaping import Shaping
from stack.planning.kinematic.shortcuts import CurveShortcut
from stack.planning.search import StepCosts
from stack.planning.smoothers.choice import SMOOTHERS
from stack.types import CostGrid, Path, Pose2D

_TABLE_REACH, _TABLE_STEP, _TABLE_TURNS = 16, 0.25, 36  # cells to a side; radii; headings
_TABLE_SLACK = 0.3  # radii by which rounding to the table's places may lengthen a curve


@dataclass(frozen=True)
class HybridAstarParameters:
    """How hybrid A* searches and weighs. Names and meanings follow Nav2's SmacPlannerHybrid."""

    motion: str = parameter(
        "reeds_shepp", one_of=("dubins", "reeds_shepp"),
        help="dubins only drives forward, reeds_shepp backward as well",
    )  # fmt: skip
    turning_radius: float = parameter(
        0.4, "m", above=0.0, at_most=50.0, help="least radius of the path"
    )
    cost_weight: float = parameter(
        3.0, at_least=0.0, at_most=50.0,
        help="how many times its length a way costs more where the costmap is fullest (252)",
    )  # fmt: skip
    reverse_penalty: float = parameter(
        2.0, at_least=1.0, at_most=50.0, help="a metre backward counts this many"
    )
    non_straight_penalty: float = parameter(
        1.1, at_least=1.0, at_most=50.0, help="a metre of an arc counts this many"
    )
    change_penalty: float = parameter(
        0.1, "m", at_least=0.0, at_most=50.0,
        help="what a change of direction or from left to right counts",
    )  # fmt: skip
    analytic_ratio: float = parameter(
        3.5, above=0.0, at_most=100.0,
        help="tries to reach the goal in one go this often as it comes nearer",
    )  # fmt: skip
    max_expansions: int = parameter(
        500_000, at_least=1, at_most=100_000_000, help="poses looked at before it gives up"
    )
    allow_unknown: bool = parameter(True, help="plan through cells nobody has seen")
    tolerance: float = parameter(
        0.2, "m", at_least=0.0, at_most=5.0,
        help="when the goal cannot be reached, a place this near will do; 0 is exactly there",
    )  # fmt: skip
    escape_distance: float = parameter(
        0.3, "m", at_least=0.0, at_most=2.0,
        help="how far a plan may lead out of a place where the robot touches something",
    )  # fmt: skip
    allow_partial: bool = parameter(
        False, help="when the goal cannot be reached, lead as near to it as can be"
    )
    smoother: str = parameter(
        "constrained", one_of=SMOOTHERS, help="what is done to the path between cusps"
    )


class HybridAstar:
    """Path of poses that a vehicle with a turning circle can drive, clear for its footprint.

    D. Dolgov, S. Thrun, M. Montemerlo, J. Diebel, "Path Planning for Autonomous Vehicles in Unknown
    Semi-structured Environments", IJRR 2010: A* over poses in cells of place and heading (72), each
    with the pose that reached it; two heuristics, the cost to go of a point among the obstacles and
    the shortest curve on open floor; attempts to reach the goal exactly by such a curve. Headings
    of the path are the robot's: in reverse they point against the motion.

    Args:
        parameters: motion, radius, penalties and tolerances.
        robot: its footprint is kept clear of lethal cells, its middle of inscribed ones.
    """

    Parameters: ClassVar[type] = HybridAstarParameters

    def __init__(self, parameters: HybridAstarParameters, robot: RobotDescription) -> None:
        p = parameters
        self._parameters = p
        tables = StepCosts.of(p.cost_weight, p.allow_unknown)
        self._prices = Prices(p.reverse_penalty, p.non_straight_penalty, p.change_penalty)
        self._methods: dict[float, Method] = {}
        escape = max(p.escape_distance, 1.3 * robot.footprint.inscribed_radius)
        self._planning = PosePlanning(
            footprint=robot.footprint,
            tables=tables,
            endpoints=Endpoints(tables.traverse, p.tolerance, escape, p.allow_partial),
            shaping=Shaping(p.smoother, p.turning_radius, tables.traverse),
            method=self._method,
            seeds=as_it_stands,
        )

    def plan(self, costs: CostGrid, start: Pose2D, goal: Pose2D) -> Path:
        """Poses at most a cell apart from start to goal, both exactly, in the map frame.

        Where the goal cannot be reached, the path ends at the nearest pose within the tolerance.

        Raises:
            NavigationError: NO_VALID_PATH, START_OCCUPIED, GOAL_OCCUPIED, START_OUTSIDE_MAP,
                GOAL_OUTSIDE_MAP, or TIMED_OUT after max_expansions.
        """
        return self._planning.plan(costs, start, goal)

    def _method(self, resolution: float) -> Method:
        if resolution not in self._methods:
            self._methods[resolution] = self._new_method(resolution)
        return self._methods[resolution]

    def _new_method(self, resolution: float) -> Method:
        p = self._parameters
        both_ways = p.motion == "reeds_shepp"
        moves = steering_moves(p.turning_radius, resolution, both_ways)
        headings = np.linspace(0.0, 2.0 * pi, HEADINGS, endpoint=False)
        return Method(
            moves=packed([moves] * HEADINGS, self._prices, headings),
            shortcuts=(CurveShortcut(both_ways, p.turning_radius, self._prices),),
            table=_curve_lengths(both_ways) * np.float32(p.turning_radius),
            table_step=_TABLE_STEP * p.turning_radius,
            table_slack=_TABLE_SLACK * p.turning_radius,
            ratio=p.analytic_ratio * moves[0].length,
            most=p.max_expansions,
        )


def as_it_stands(ground: Ground, start: Pose2D) -> list[Drive]:
    """The start itself, for vehicles that cannot turn in place."""
    pose = np.array([[start.x, start.y, start.heading]])
    return [Drive(pose, np.zeros(1, np.int64), 0.0)]


@lru_cache(maxsize=2)
def _curve_lengths(both_ways: bool) -> NDArray[np.float32]:
    """Lengths of the shortest curves of radius 1 around the origin; see `kernels.Aim.table`."""
    from stack.planning.curves import kernels

    table: Any = kernels.distance_table
    lengths: NDArray[np.float32] = table(both_ways, _TABLE_REACH, _TABLE_STEP, _TABLE_TURNS)
    return lengths
