"""Theta* planner: any-angle paths, weighted by the costs of the cells that they cross."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from stack.compilation import KernelTypes
from stack.components import DEFAULT_PLAN_OPTIONS, Planner, PlanOptions
from stack.drivetrain.description import RobotDescription
from stack.parameters import parameter
from stack.planning.endpoints import (
    Cell,
    Endpoints,
    cell_index,
    cell_on_map,
    enclosed_start,
    fractional_cell,
    straight_path,
    through_centres,
)
from stack.planning.outline_check import fallback_kernels
from stack.planning.parameters import PlannerParameters
from stack.planning.search import SearchLimits, StepCosts, Workspace
from stack.planning.smoothers.choice import SMOOTHERS, point_smoother, point_smoother_kernels
from stack.types import CostGrid, FailureCode, FloatArray, Path, Pose2D


@dataclass(frozen=True)
class ThetaStarParameters(PlannerParameters):
    """Parameters of the Theta* planner."""

    euclidean_weight: float = parameter(
        1.0, above=0.0, at_most=50.0, help="cost of a metre over free cells"
    )
    traversal_weight: float = parameter(
        3.0, at_least=0.0, at_most=50.0,
        help="extra cost of a metre at the highest passable cell cost (252)",
    )  # fmt: skip
    smoother: str = parameter(
        "simple", one_of=SMOOTHERS, public=True, help="smoother for the straight lines"
    )


class ThetaStar(Planner):
    """Lazy Theta*: any-angle path of straight lines by length and cell costs, smoothed.

    A. Nash, S. Koenig, C. Tovey, "Lazy Theta*: Any-Angle Path Planning and Path Length Analysis in
    3D", AAAI 2010. A line costs its length times (euclidean_weight + traversal_weight · c / 252),
    where c is the length-weighted mean cost of the cells it crosses. The search finds a path to
    every reachable goal, and no path of 8-connected steps is cheaper than the one found.

    Args:
        parameters: weights and tolerances.
        robot: 1.3 times its inscribed radius is the least escape distance.
    """

    Parameters: ClassVar[type] = ThetaStarParameters
    ignores_outline: ClassVar[bool] = True

    @staticmethod
    def kernels(parameters: ThetaStarParameters, robot: RobotDescription) -> KernelTypes:
        """Return the kernels of a run with this component."""
        from stack.planning import kernels
        from stack.planning.theta_star.kernels import SEARCH

        used = (*SEARCH, *kernels.EXTRACTION, *kernels.ENDPOINTS)
        more = fallback_kernels(robot)
        return (*used, *point_smoother_kernels(parameters.smoother), *more)

    def __init__(self, parameters: ThetaStarParameters, robot: RobotDescription) -> None:
        self.parameters = parameters
        share = parameters.traversal_weight / parameters.euclidean_weight
        self._tables = StepCosts.of(share, parameters.allow_unknown)
        self._weights: FloatArray = self._tables.traverse.astype(np.float64) * (
            parameters.euclidean_weight / 100.0
        )
        self._endpoints = Endpoints.of(parameters, robot.footprint, self._tables.traverse)
        self._smoother = point_smoother(parameters.smoother, self._tables.traverse)

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
        an inscribed or lethal cell the path first takes the cheapest route to a passable cell.

        Raises:
            NavigationError: NO_VALID_PATH, START_OCCUPIED, GOAL_OCCUPIED, START_OUTSIDE_MAP,
                GOAL_OUTSIDE_MAP, TIMED_OUT after max_expansions, or CANCELLED.
        """
        ends = self._endpoints.with_options(options)
        limits = SearchLimits(self.parameters.max_expansions, options.cancel)
        start_cell = ends.start_cell(costs, start)
        goal_cell = cell_on_map(costs, goal, "goal", FailureCode.GOAL_OUTSIDE_MAP)
        target = ends.goal_cell(costs, goal)
        escape_path = self._escape_path(costs, start_cell, target, limits)
        if not escape_path:
            raise enclosed_start(start)
        search = _Search.run(self._weights, costs, (escape_path[-1], target), limits)
        if not search.found:
            near = search.nearest(costs, goal)
            if search.limited:
                ends.check_limited(costs, (start, goal), near, search.expanded)
            target = ends.accept_nearest(costs, start, goal, near)
        corners = np.array([*escape_path[:-1], *search.corners(costs, target)], dtype=np.int64)
        end = goal
        if target != goal_cell:
            end = Pose2D(*costs.centre_of(*target), goal.heading)
        if start_cell == target:
            return ends.mark_partial(straight_path(start, end), goal)
        points = through_centres(costs, corners[1:-1], start, end)
        return ends.mark_partial(self._smoother.smooth(costs, points, end.heading), goal)

    def _escape_path(
        self, costs: CostGrid, start: Cell, target: Cell, limits: SearchLimits
    ) -> list[Cell]:
        """Return the cells of A*'s path from an impassable start to the first passable cell.

        Returns only the start if it is passable, and nothing if no passable cell can be reached.
        """
        tables = self._tables
        if tables.traverse[costs.cells[start]] > 0:
            return [start]
        from stack.planning import kernels

        extract: Any = kernels.extract
        rows, columns = costs.cells.shape
        workspace = Workspace(rows, columns, tables)
        reach, end = round(self._endpoints.escape_distance / costs.resolution), target
        begin = cell_index(costs, start)
        if not workspace.run(costs, begin, cell_index(costs, target), reach, limits):
            near = workspace.nearest_reached(costs, Pose2D(*costs.centre_of(*target)))
            if near is None:
                return []
            end = near
        cells = extract(workspace.parents, columns, begin, cell_index(costs, end))
        path = [(int(row), int(column)) for row, column in cells]
        free = [n for n, cell in enumerate(path) if tables.traverse[costs.cells[cell]] > 0]
        return path[: free[0] + 1] if free else path


@dataclass(frozen=True)
class _Search:
    """Result of a search from cell to cell.

    Attributes:
        found: whether it reached its target.
        limited: whether it stopped at its limit of expansions.
        expanded: number of cells expanded.
        parents: (cells,) int32, valid where closed.
        closed: (cells,) bool.
    """

    found: bool
    limited: bool
    expanded: int
    parents: NDArray[np.int32]
    closed: NDArray[np.bool_]

    @staticmethod
    def run(
        weights: FloatArray, costs: CostGrid, ends: tuple[Cell, Cell], limits: SearchLimits
    ) -> _Search:
        """Search from the first cell to the second."""
        from stack.planning.theta_star import kernels

        search: Any = kernels.search
        size = costs.cells.size
        so_far = np.full(size, kernels.NOT_REACHED)
        parents, closed = np.empty(size, np.int32), np.zeros(size, np.bool_)
        status, expanded = search(
            costs.cells, weights, float(weights[0]), so_far, parents, closed,
            cell_index(costs, ends[0]), cell_index(costs, ends[1]),
            limits.max_expansions, limits.cancel.flag,
        )  # fmt: skip
        limits.cancel.check()
        found, limited = status == kernels.FOUND, status == kernels.LIMIT
        return _Search(found, limited, int(expanded), parents, closed)

    def nearest(self, costs: CostGrid, goal: Pose2D) -> Cell:
        """Return the closed cell nearest to a pose."""
        from stack.planning.theta_star import kernels

        nearest: Any = kernels.nearest_closed
        columns = costs.cells.shape[1]
        row, column = divmod(
            int(nearest(self.closed, columns, *fractional_cell(costs, goal))), columns
        )
        return row, column

    def corners(self, costs: CostGrid, target: Cell) -> list[Cell]:
        """Return the corner cells of the path to a closed cell, both ends included."""
        cells = [cell_index(costs, target)]
        while self.parents[cells[-1]] != cells[-1]:
            cells.append(int(self.parents[cells[-1]]))
        return [divmod(cell, costs.cells.shape[1]) for cell in reversed(cells)]
