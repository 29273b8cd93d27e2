"""State lattice planner for differential robots that can turn in place."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from stack.drivetrain.description import RobotDescription
from stack.errors import InputError
from stack.parameters import parameter
from stack.planning.kinematic.moves import (
    Penalties,
    lattice_headings,
    lattice_moves,
    pack_moves,
    turned,
)
from stack.planning.kinematic.parameters import PosePlannerParameters
from stack.planning.kinematic.planning import PosePlanner
from stack.planning.kinematic.search import CollisionChecker, PoseDrive, SearchMethod
from stack.planning.kinematic.shortcuts import CurveShortcut, TurnDriveTurn
from stack.types import Pose2D, wrap_angle

_RADIUS = 0.5  # m


@dataclass(frozen=True)
class LatticeParameters(PosePlannerParameters):
    """Parameters of the lattice planner. Meanings follow Nav2's SmacPlannerLattice."""

    turning_radius: float | None = parameter(
        None, "m", above=0.0, at_most=2.0, public=True,
        help="minimum radius of arcs; default: 0.5 m; turns in place are allowed in any case",
    )  # fmt: skip
    allow_reverse: bool = parameter(
        True, public=True, help="short straight moves backward, if the robot can"
    )
    rotation_penalty: float = parameter(
        0.4, "m", at_least=0.0, at_most=50.0, help="cost of a radian turned in place"
    )
    non_straight_penalty: float = parameter(
        1.05, at_least=1.0, at_most=50.0, help="cost factor for arcs"
    )
    change_penalty: float = parameter(
        0.05, "m", at_least=0.0, at_most=50.0,
        help="cost of a change of driving direction or of steering side",
    )  # fmt: skip


class Lattice(PosePlanner):
    """State lattice: collision-free path of straights, arcs and turns in place.

    M. Pivtoraiko, A. Kelly, "Efficient constrained path planning via search in state lattices",
    i-SAIRAS 2005: A* over cell centres at sixteen headings, connected by motion primitives that
    end exactly on them; the lattice is centred on the start. The goal is connected exactly by a
    turn, a straight and a turn, or by a shortest curve where there is no room to turn.

    Args:
        parameters: radius, penalties and tolerances.
        robot: its footprint stays clear of lethal cells, its base of inscribed ones.

    Raises:
        InputError: the robot cannot turn in place.
    """

    Parameters: ClassVar[type] = LatticeParameters
    parameters: LatticeParameters

    @staticmethod
    def check(parameters: LatticeParameters, robot: RobotDescription) -> None:
        """Raise InputError for a robot that cannot turn in place."""
        if robot.turning_radius > 0.0:
            raise InputError(
                f"planner lattice needs a robot that turns in place; the turning radius of "
                f"{robot.name} is {robot.turning_radius:.3g} m; use hybrid_astar"
            )

    def __init__(self, parameters: LatticeParameters, robot: RobotDescription) -> None:
        p = parameters
        self.check(p, robot)
        radius = _RADIUS if p.turning_radius is None else p.turning_radius
        penalties = Penalties(
            p.reverse_penalty, p.non_straight_penalty, p.change_penalty, p.rotation_penalty
        )
        super().__init__(p, robot, radius, penalties)
        self._reverse = p.allow_reverse and robot.limits.reverse_speed > 0.0

    def _new_method(self, resolution: float) -> SearchMethod:
        p, penalties = self.parameters, self._penalties
        moves = lattice_moves(self._radius, resolution, self._reverse)
        return SearchMethod(
            moves=pack_moves(moves, penalties, lattice_headings()),
            shortcuts=(
                TurnDriveTurn(penalties),
                CurveShortcut(self._reverse, self._radius, penalties),
            ),
            table=np.zeros((1, 1, 1), np.float32),
            table_step=1.0,
            table_slack=0.0,
            ratio=p.analytic_ratio * 2.0 * resolution,
            max_expansions=p.max_expansions,
            penalties=penalties,
        )

    def _seeds(self, checker: CollisionChecker, start: Pose2D) -> list[PoseDrive]:
        """Return the start turned to the two nearest lattice headings.

        If the robot has no room to turn that far, the start itself is the only seed, and its moves
        are not aligned with the lattice.
        """
        pose = np.array([start.x, start.y, start.heading])
        contacts = checker.allowed_contacts(start)
        seeds = []
        aside = [wrap_angle(float(turn) - start.heading) for turn in lattice_headings()]
        for angle in sorted(aside, key=abs)[:2]:
            poses = np.vstack([pose, turned(pose, angle)])
            if checker.weight(poses, contacts) > 0.0:
                cost = self._penalties.rotation * abs(angle)
                seeds.append(PoseDrive(poses, np.zeros(len(poses), np.int64), cost))
        return seeds or super()._seeds(checker, start)
