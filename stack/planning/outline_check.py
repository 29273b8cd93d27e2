"""Paths of planners without an outline, checked with the outline of a long or off-centre robot."""

from __future__ import annotations

from dataclasses import fields
from itertools import pairwise
from math import ceil, hypot
from typing import Any

import numpy as np

from stack.compilation import KernelTypes
from stack.components import DEFAULT_PLAN_OPTIONS, Choice, Planner, PlanOptions, choose
from stack.drivetrain.description import RobotDescription
from stack.errors import NavigationError
from stack.parameters import values_of
from stack.planning.kinematic.planning import pose_planner_kernels
from stack.planning.kinematic.search import CollisionChecker
from stack.planning.parameters import PlannerParameters
from stack.planning.search import StepCosts
from stack.types import CostGrid, FailureCode, FloatArray, Path, Pose2D, wrap_angle

_APART = 0.1
"""Radians and metres between the checked poses of a path, at most."""
_OWN = ("max_expansions",)
"""Shared parameters of which each planner keeps its own value."""
_FINAL = frozenset(
    {FailureCode.CANCELLED, FailureCode.START_OUTSIDE_MAP, FailureCode.GOAL_OUTSIDE_MAP}
)
"""Failures that another planner would share."""


class OutlineChecked(Planner):
    """A planner whose paths are swept with the outline; where it touches, poses are searched.

    A planner without an outline keeps a disc about the base free. For a robot that is much longer
    than wide, or whose base is near an end, a gap that the disc passes may be too narrow.

    Args:
        planner: plans first.
        robot: its footprint is swept; `lattice` plans for it, or `hybrid_astar` for a car.
    """

    def __init__(self, planner: Planner, robot: RobotDescription) -> None:
        super().__init__(planner.parameters, robot)
        self._planner, self._footprint = planner, robot.footprint
        values: Any = planner.parameters
        self._tables = StepCosts.of(0.0, values.allow_unknown)
        kept = [item.name for item in fields(PlannerParameters) if item.name not in _OWN]
        given = {name: value for name, value in values_of(values).items() if name in kept}
        self._fallback: Planner = choose("planner", fallback_name(robot), given).create(robot)

    def plan(
        self,
        costs: CostGrid,
        start: Pose2D,
        goal: Pose2D,
        options: PlanOptions = DEFAULT_PLAN_OPTIONS,
    ) -> Path:
        """Return the planner's path if the outline is free along it, else that of the fallback.

        Raises:
            NavigationError: as the fallback.
        """
        try:
            path = self._planner.plan(costs, start, goal, options)
        except NavigationError as error:
            if error.failure.code in _FINAL:
                raise
        else:
            checker = CollisionChecker.of(costs, self._footprint, self._tables)
            if is_free(checker, start, path):
                return path
        return self._fallback.plan(costs, start, goal, options)


def outline_checked(choice: Choice, robot: RobotDescription) -> Planner:
    """Return the chosen planner, checked if it has no outline and the robot needs one."""
    planner: Planner = choice.create(robot)
    needs_check = planner.ignores_outline and not robot.footprint.is_compact
    return OutlineChecked(planner, robot) if needs_check else planner


def fallback_name(robot: RobotDescription) -> str:
    """Return the name of the pose planner for a robot."""
    return "hybrid_astar" if robot.turning_radius > 0.0 else "lattice"


def fallback_kernels(robot: RobotDescription) -> KernelTypes:
    """Return the further kernels of a planner without outline for this robot."""
    return () if robot.footprint.is_compact else pose_planner_kernels("constrained")


def is_free(checker: CollisionChecker, start: Pose2D, path: Path) -> bool:
    """Return whether the outline is free along a path, turns on the spot included.

    From a start in contact the robot may leave, with no more contact than at the start.
    """
    allowed = checker.allowed_contacts(start)
    for x, y, heading in swept_poses(start, path):
        contacts = checker.contacts(Pose2D(x, y, heading))
        if contacts == 0:
            allowed = 0
        elif contacts > allowed:
            return False
    return True


def swept_poses(start: Pose2D, path: Path) -> FloatArray:
    """Return (n, 3) poses along a path from the robot's own, at most _APART from each other."""
    points = np.vstack([[start.x, start.y, start.heading], path.points])
    parts = [points[:1]]
    for before, after in pairwise(points):
        turn = wrap_angle(float(after[2] - before[2]))
        way = hypot(after[0] - before[0], after[1] - before[1])
        pieces = max(1, ceil(max(abs(turn), way) / _APART))
        share = np.arange(1, pieces + 1)[:, None] / pieces
        parts.append(before + share * (after[0] - before[0], after[1] - before[1], turn))
    return np.vstack(parts)
