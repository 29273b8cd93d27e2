"""Base class of the planners that search the cells of a costmap."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from stack.compilation import KernelTypes
from stack.components import DEFAULT_PLAN_OPTIONS, Planner, PlanOptions
from stack.drivetrain.description import RobotDescription
from stack.parameters import parameter
from stack.planning.endpoints import Cell, Endpoints, cell_on_map
from stack.planning.outline_check import fallback_kernels
from stack.planning.parameters import PlannerParameters
from stack.planning.search import ExpansionLimits, StepCosts
from stack.planning.smoothers.choice import SMOOTHERS, point_smoother_kernels, smooth
from stack.planning.smoothing import PathCosts
from stack.types import CostGrid, FailureCode, Path, Pose2D


@dataclass(frozen=True)
class CellPlannerParameters(PlannerParameters):
    """Parameters of a search over cells."""

    smoother: str = parameter(
        "simple", one_of=SMOOTHERS, public=True, help="smoother for the path of cells"
    )


@dataclass(frozen=True)
class CellQuery:
    """Start and goal of a plan, with the cells that the search connects."""

    costs: CostGrid
    start: Pose2D
    start_cell: Cell
    goal: Pose2D
    target: Cell
    ends: Endpoints
    limits: ExpansionLimits

    def nearest(self, near: Cell | None, expanded: int | None) -> Cell:
        """Return the cell at which a search ends that did not reach the target, if acceptable."""
        return self.ends.accept_nearest(self.costs, (self.start, self.goal), near, expanded)


class CellPlanner(Planner):
    """Searches from cell to cell, and smooths what it has found.

    Args:
        parameters: weights and tolerances.
        robot: 1.3 times its inscribed radius is the least escape distance.
        tables: costs of steps.
    """

    ignores_outline: ClassVar[bool] = True

    @staticmethod
    def kernels(parameters: Any, robot: RobotDescription) -> KernelTypes:
        from stack.planning import kernels

        used = (*kernels.EXTRACTION, *kernels.ENDPOINTS)
        return (*used, *point_smoother_kernels(parameters.smoother), *fallback_kernels(robot))

    def __init__(self, parameters: Any, robot: RobotDescription, tables: StepCosts) -> None:
        super().__init__(parameters, robot)
        self._tables = tables
        self._endpoints = Endpoints.of(parameters, robot.footprint, tables.traverse)

    @abstractmethod
    def _search(self, query: CellQuery) -> tuple[Cell, NDArray[np.int64]]:
        """Return the last cell of the path, and (n, 2) the cells whose centres it passes.

        The last cell is the target, or the reachable cell nearest to the goal.
        """

    def plan(
        self,
        costs: CostGrid,
        start: Pose2D,
        goal: Pose2D,
        options: PlanOptions = DEFAULT_PLAN_OPTIONS,
    ) -> Path:
        """Return a path of poses 5 cm apart from exactly the start to exactly the goal, map frame.

        Headings follow the path, except that the last one is the goal's. If the goal cannot be
        reached, the path ends at the nearest reachable cell within the tolerance. From a start in
        an inscribed or lethal cell (noise, a person close by) the path first takes the cheapest
        route to a passable cell.

        Raises:
            NavigationError: NO_VALID_PATH, START_OCCUPIED, GOAL_OCCUPIED, START_OUTSIDE_MAP,
                GOAL_OUTSIDE_MAP, TIMED_OUT after max_expansions, or CANCELLED.
        """
        ends = self._endpoints.with_options(options)
        start_cell = ends.start_cell(costs, start)
        goal_cell = cell_on_map(costs, goal, "goal", FailureCode.GOAL_OUTSIDE_MAP)
        limits = ExpansionLimits(self.parameters.max_expansions, options.cancel)
        target = ends.goal_cell(costs, goal)
        query = CellQuery(costs, start, start_cell, goal, target, ends, limits)
        last, cells = self._search(query)
        end = goal
        if last != goal_cell:
            end = Pose2D(*costs.centre_of(*last), goal.heading)
        if start_cell == last:
            return ends.mark_partial(_straight_path(start, end), goal)
        middles = (cells[:, ::-1] + 0.5) * costs.resolution + np.array(costs.origin)
        points = np.vstack([(start.x, start.y), middles, (end.x, end.y)])
        on = PathCosts(costs, self._tables.traverse)
        path = smooth(self.parameters.smoother, on, points, end.heading)
        return ends.mark_partial(path, goal)


def _straight_path(start: Pose2D, goal: Pose2D) -> Path:
    """Return a path of two poses, for a start and a goal in the same cell."""
    apart = start.distance_to(goal) > 0.0
    heading = start.bearing_to(goal) if apart else goal.heading
    return Path(np.array([[start.x, start.y, heading], [goal.x, goal.y, goal.heading]]))
