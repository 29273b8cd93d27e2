"""Any-angle planning: straight lines from corner to corner, weighed by what they cross."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from stack.components import DEFAULT_PLAN_OPTIONS, PlanOptions
from stack.drivetrain.description import RobotDescription
from stack.parameters import parameter
from stack.planning.endpoints import (
    Cell,
    Endpoints,
    cell_on_map,
    in_cells,
    number,
    shut_in,
    straight,
    through_centres,
)
from stack.planning.parameters import PlannerParameters
from stack.planning.search import Effort, StepCosts, Workspace
from stack.planning.smoothers.choice import SMOOTHERS, point_smoother
from stack.types import CostGrid, FailureCode, FloatArray, Path, Pose2D


@dataclass(frozen=True)
class ThetaStarParameters(PlannerParameters):
    """How Theta* weighs ways against each other."""

    euclidean_weight: float = parameter(
        1.0, above=0.0, at_most=50.0, help="what a metre counts wherever it leads"
    )
    traversal_weight: float = parameter(
        3.0, at_least=0.0, at_most=50.0,
        help="what a metre counts more where the costmap is fullest (252)",
    )  # fmt: skip
    smoother: str = parameter("simple", one_of=SMOOTHERS, help="what is done to the corners")


class ThetaStar:
    """Any-angle path of straight lines, cheapest by length and costs (lazy Theta*), smoothed.

    A. Nash, S. Koenig, C. Tovey, "Lazy Theta*: Any-Angle Path Planning and Path Length Analysis in
    3D", AAAI 2010. A line costs its length times (euclidean_weight + traversal_weight · c / 252), c
    the cost of the cells it crosses, each to its share. A reachable goal is never missed, and no
    path from cell to neighbouring cell is cheaper than the one found.

    Args:
        parameters: weights and tolerances.
        robot: its inscribed radius widens the escape distance where that is larger.
    """

    Parameters: ClassVar[type] = ThetaStarParameters

    def __init__(self, parameters: ThetaStarParameters, robot: RobotDescription) -> None:
        self._parameters = parameters
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
        """A path of poses 5 cm apart from start to goal, both exactly, in the map frame.

        Headings follow the path, but the last one is the goal's. Where the goal cannot be reached,
        the path ends at the nearest place within the tolerance that can. A start in an inscribed or
        lethal cell is left by the cheapest way to a better cell.

        Raises:
            NavigationError: NO_VALID_PATH, START_OCCUPIED, GOAL_OCCUPIED, START_OUTSIDE_MAP,
                GOAL_OUTSIDE_MAP, TIMED_OUT after max_expansions, or CANCELLED.
        """
        ends = self._endpoints.on(options)
        effort = Effort(self._parameters.max_expansions, options.cancel)
        start_cell = ends.start_cell(costs, start)
        goal_cell = cell_on_map(costs, goal, "goal", FailureCode.GOAL_OUTSIDE_MAP)
        target = ends.goal_cell(costs, goal)
        way_out = self._way_out(costs, start_cell, target, effort)
        if not way_out:
            raise shut_in(start)
        search = _Search.run(self._weights, costs, (way_out[-1], target), effort)
        if not search.found:
            near = search.nearest(costs, goal)
            if search.limited:
                ends.check_limited(costs, (start, goal), near, search.expanded)
            target = ends.accept_nearest(costs, start, goal, near)
        corners = np.array([*way_out[:-1], *search.corners(costs, target)], dtype=np.int64)
        end = goal
        if target != goal_cell:
            end = Pose2D(*costs.centre_of(*target), goal.heading)
        if start_cell == target:
            return ends.marked(straight(start, end), goal)
        points = through_centres(costs, corners[1:-1], start, end)
        return ends.marked(self._smoother.smooth(costs, points, end.heading), goal)

    def _way_out(self, costs: CostGrid, start: Cell, target: Cell, effort: Effort) -> list[Cell]:
        """The cells by which A* leaves a start with no way, up to the first that has one.

        One alone where the start has a way; empty when nothing free can be reached.
        """
        tables = self._tables
        if tables.traverse[costs.cells[start]] > 0:
            return [start]
        from stack.planning import kernels

        extract: Any = kernels.extract
        rows, columns = costs.cells.shape
        workspace = Workspace(rows, columns, tables)
        reach, end = round(self._endpoints.escape_distance / costs.resolution), target
        begin = number(costs, start)
        if not workspace.run(costs, begin, number(costs, target), reach, effort):
            near = workspace.nearest_reached(costs, Pose2D(*costs.centre_of(*target)))
            if near is None:
                return []
            end = near
        cells = extract(workspace.parents, columns, begin, number(costs, end))
        way = [(int(row), int(column)) for row, column in cells]
        free = [n for n, cell in enumerate(way) if tables.traverse[costs.cells[cell]] > 0]
        return way[: free[0] + 1] if free else way


@dataclass(frozen=True)
class _Search:
    """What a search from cell to cell came to.

    Attributes:
        found: whether it reached its target.
        limited: whether it ended at its limit of expansions.
        expanded: cells.
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
        weights: FloatArray, costs: CostGrid, ends: tuple[Cell, Cell], effort: Effort
    ) -> _Search:
        """Search from the first cell to the second."""
        from stack.planning.theta_star import kernels

        search: Any = kernels.search
        size = costs.cells.size
        so_far = np.full(size, kernels.NOT_REACHED)
        parents, closed = np.empty(size, np.int32), np.zeros(size, np.bool_)
        status, expanded = search(
            costs.cells, weights, float(weights[0]), so_far, parents, closed,
            number(costs, ends[0]), number(costs, ends[1]), effort.most, effort.cancel.flag,
        )  # fmt: skip
        effort.cancel.check()
        found, limited = status == kernels.FOUND, status == kernels.LIMIT
        return _Search(found, limited, int(expanded), parents, closed)

    def nearest(self, costs: CostGrid, goal: Pose2D) -> Cell:
        """The cell reached that is nearest to a place."""
        from stack.planning.theta_star import kernels

        nearest: Any = kernels.nearest_closed
        columns = costs.cells.shape[1]
        row, column = divmod(int(nearest(self.closed, columns, *in_cells(costs, goal))), columns)
        return row, column

    def corners(self, costs: CostGrid, target: Cell) -> list[Cell]:
        """The corners of the way to a cell reached, both ends included."""
        cells = [number(costs, target)]
        while self.parents[cells[-1]] != cells[-1]:
            cells.append(int(self.parents[cells[-1]]))
        return [divmod(cell, costs.cells.shape[1]) for cell in reversed(cells)]
