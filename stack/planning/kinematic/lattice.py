"""State lattice: moves of a differential robot that may also turn in place."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from stack.components import DEFAULT_PLAN_OPTIONS, PlanOptions
from stack.drivetrain.description import RobotDescription
from stack.errors import InputError
from stack.parameters import parameter
from stack.planning.endpoints import Endpoints
from stack.planning.kinematic.moves import Prices, lattice_headings, lattice_moves, packed
from stack.planning.kinematic.parameters import PosePlannerParameters, may_reverse
from stack.planning.kinematic.planning import PosePlanning
from stack.planning.kinematic.search import Drive, Ground, Method
from stack.planning.kinematic.shaping import Shaping
from stack.planning.kinematic.shortcuts import CurveShortcut, TurnDriveTurn, turned
from stack.planning.search import StepCosts
from stack.types import CostGrid, Path, Pose2D, wrap_angle

_RADIUS = 0.5  # m


@dataclass(frozen=True)
class LatticeParameters(PosePlannerParameters):
    """How the lattice is searched and weighed. Meanings follow Nav2's SmacPlannerLattice."""

    turning_radius: float | None = parameter(
        None, "m", above=0.0, at_most=2.0,
        help="least radius of the arcs, 0.5 m when left out; turns in place are apart",
    )  # fmt: skip
    allow_reverse: bool = parameter(True, help="also short straights backward, if the robot can")
    rotation_penalty: float = parameter(
        0.4, "m", at_least=0.0, at_most=50.0, help="what a radian turned in place counts"
    )
    non_straight_penalty: float = parameter(
        1.05, at_least=1.0, at_most=50.0, help="a metre of an arc counts this many"
    )
    change_penalty: float = parameter(
        0.05, "m", at_least=0.0, at_most=50.0,
        help="what a change of direction or from left to right counts",
    )  # fmt: skip


class Lattice:
    """Path of straights, arcs and turns in place on a lattice of poses, clear for the footprint.

    M. Pivtoraiko, A. Kelly, "Efficient constrained path planning via search in state lattices",
    i-SAIRAS 2005: A* over middles of cells at sixteen headings, joined by moves that were made to
    meet them; the lattice lies with its middle on the start. The goal is joined exactly by a turn,
    a straight and a turn, or where there is no room to turn by a shortest curve.

    Args:
        parameters: radius, penalties and tolerances.
        robot: its footprint is kept clear of lethal cells, its middle of inscribed ones.

    Raises:
        InputError: the robot cannot turn in place.
    """

    Parameters: ClassVar[type] = LatticeParameters

    @staticmethod
    def check(parameters: LatticeParameters, robot: RobotDescription) -> None:
        """Raise InputError for a robot that cannot turn in place."""
        if robot.turning_radius > 0.0:
            raise InputError(
                f"planner lattice: it turns in place, and {robot.name} cannot turn more tightly "
                f"than in a circle of {robot.turning_radius:.3g} m; use hybrid_astar"
            )

    def __init__(self, parameters: LatticeParameters, robot: RobotDescription) -> None:
        p = parameters
        self._parameters = p
        tables = StepCosts.of(p.cost_weight, p.allow_unknown)
        self._prices = Prices(
            p.reverse_penalty, p.non_straight_penalty, p.change_penalty, p.rotation_penalty
        )
        self.check(parameters, robot)
        self._methods: dict[float, Method] = {}
        self._radius = _RADIUS if p.turning_radius is None else p.turning_radius
        self._reverse = p.allow_reverse and may_reverse(robot)
        self._planning = PosePlanning(
            footprint=robot.footprint,
            tables=tables,
            endpoints=Endpoints.of(p, robot.footprint, tables.traverse),
            shaping=Shaping(p.smoother, self._radius, tables.traverse),
            method=self._method,
            seeds=self._seeds,
        )

    def plan(
        self,
        costs: CostGrid,
        start: Pose2D,
        goal: Pose2D,
        options: PlanOptions = DEFAULT_PLAN_OPTIONS,
    ) -> Path:
        """Poses at most a cell apart from start to goal, both exactly, in the map frame.

        A turn in place shows as a corner. Where the goal cannot be reached, the path ends at the
        nearest pose within the tolerance.

        Raises:
            NavigationError: NO_VALID_PATH, START_OCCUPIED, GOAL_OCCUPIED, START_OUTSIDE_MAP,
                GOAL_OUTSIDE_MAP, TIMED_OUT after max_expansions, or CANCELLED.
        """
        return self._planning.plan(costs, start, goal, options)

    def _method(self, resolution: float) -> Method:
        if resolution not in self._methods:
            p = self._parameters
            moves = lattice_moves(self._radius, resolution, self._reverse)
            self._methods[resolution] = Method(
                moves=packed(moves, self._prices, lattice_headings()),
                shortcuts=(
                    TurnDriveTurn(self._prices),
                    CurveShortcut(self._reverse, self._radius, self._prices),
                ),
                table=np.zeros((1, 1, 1), np.float32),
                table_step=1.0,
                table_slack=0.0,
                ratio=p.analytic_ratio * 2.0 * resolution,
                most=p.max_expansions,
            )
        return self._methods[resolution]

    def _seeds(self, ground: Ground, start: Pose2D) -> list[Drive]:
        """The start turned to the headings of the lattice next to it, or as it stands.

        Where the robot cannot even turn that far, its moves begin askew to the lattice.
        """
        pose = np.array([start.x, start.y, start.heading])
        contacts = ground.allowed(start)
        seeds = []
        aside = [wrap_angle(float(turn) - start.heading) for turn in lattice_headings()]
        for angle in sorted(aside, key=abs)[:2]:
            poses = np.vstack([pose, turned(pose, angle)])
            if ground.weight(poses, contacts) > 0.0:
                cost = self._prices.rotation * abs(angle)
                seeds.append(Drive(poses, np.zeros(len(poses), np.int64), cost))
        return seeds or [Drive(pose[None], np.zeros(1, np.int64), 0.0)]
