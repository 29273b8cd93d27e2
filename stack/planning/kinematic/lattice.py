"""State lattice: moves of a differential robot that may also turn in place."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from stack.description import RobotDescription
from stack.parameters import parameter
from stack.planning.endpoints import Endpoints
from stack.planning.kinematic.moves import Prices, lattice_headings, lattice_moves, packed
from stack.planning.kinematic.planning import PosePlanning
from stack.planning.kinematic.search import Drive, Ground, Method
from stack.planning.kinematic.shaping import Shaping
from stack.planning.kinematic.shortcuts import CurveShortcut, TurnDriveTurn, turned
from stack.planning.search import StepCosts
from stack.planning.smoothers.choice import SMOOTHERS
from stack.types import CostGrid, Path, Pose2D, wrap_angle


@dataclass(frozen=True)
class LatticeParameters:
    """How the lattice is searched and weighed. Meanings follow Nav2's SmacPlannerLattice."""

    turning_radius: float = parameter(
        0.5, "m", above=0.0, at_most=2.0, help="least radius of the arcs; turns in place are apart"
    )
    allow_reverse: bool = parameter(True, help="also short straights backward")
    cost_weight: float = parameter(
        3.0, at_least=0.0, at_most=50.0,
        help="how many times its length a way costs more where the costmap is fullest (252)",
    )  # fmt: skip
    rotation_penalty: float = parameter(
        0.4, "m", at_least=0.0, at_most=50.0, help="what a radian turned in place counts"
    )
    reverse_penalty: float = parameter(
        2.0, at_least=1.0, at_most=50.0, help="a metre backward counts this many"
    )
    non_straight_penalty: float = parameter(
        1.05, at_least=1.0, at_most=50.0, help="a metre of an arc counts this many"
    )
    change_penalty: float = parameter(
        0.05, "m", at_least=0.0, at_most=50.0,
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
        "constrained", one_of=SMOOTHERS, help="what is done to the path between turns in place"
    )


class Lattice:
    """Path of straights, arcs and turns in place on a lattice of poses, clear for the footprint.

    M. Pivtoraiko, A. Kelly, "Efficient constrained path planning via search in state lattices",
    i-SAIRAS 2005: A* over middles of cells at sixteen headings, joined by moves that were made to
    meet them; the lattice lies with its middle on the start. The goal is joined exactly by a turn,
    a straight and a turn, or where there is no room to turn by a shortest curve.

    Args:
        parameters: radius, penalties and tolerances.
        robot: its footprint is kept clear of lethal cells, its middle of inscribed ones.
    """

    Parameters: ClassVar[type] = LatticeParameters

    def __init__(self, parameters: LatticeParameters, robot: RobotDescription) -> None:
        p = parameters
        self._parameters = p
        tables = StepCosts.of(p.cost_weight, p.allow_unknown)
        self._prices = Prices(
            p.reverse_penalty, p.non_straight_penalty, p.change_penalty, p.rotation_penalty
        )
        self._methods: dict[float, Method] = {}
        escape = max(p.escape_distance, 1.3 * robot.footprint.inscribed_radius)
        self._planning = PosePlanning(
            footprint=robot.footprint,
            tables=tables,
            endpoints=Endpoints(tables.traverse, p.tolerance, escape, p.allow_partial),
            shaping=Shaping(p.smoother, p.turning_radius, tables.traverse),
            method=self._method,
            seeds=self._seeds,
        )

    def plan(self, costs: CostGrid, start: Pose2D, goal: Pose2D) -> Path:
        """Poses at most a cell apart from start to goal, both exactly, in the map frame.

        A turn in place shows as a corner. Where the goal cannot be reached, the path ends at the
        nearest pose within the tolerance.

        Raises:
            NavigationError: NO_VALID_PATH, START_OCCUPIED, GOAL_OCCUPIED, START_OUTSIDE_MAP,
                GOAL_OUTSIDE_MAP, or TIMED_OUT after max_expansions.
        """
        return self._planning.plan(costs, start, goal)

    def _method(self, resolution: float) -> Method:
        if resolution not in self._methods:
            p = self._parameters
            moves = lattice_moves(p.turning_radius, resolution, p.allow_reverse)
            self._methods[resolution] = Method(
                moves=packed(moves, self._prices, lattice_headings()),
                shortcuts=(
                    TurnDriveTurn(self._prices),
                    CurveShortcut(p.allow_reverse, p.turning_radius, self._prices),
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
