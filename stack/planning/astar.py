"""A* planner: the cheapest path on a costmap, then smoothed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from stack.compilation import KernelTypes
from stack.components import DEFAULT_PLAN_OPTIONS, Planner, PlanOptions
from stack.drivetrain.description import RobotDescription
from stack.parameters import parameter
from stack.planning.endpoints import (
    Cell,
    Endpoints,
    cell_index,
    cell_on_map,
    straight_path,
    through_centres,
)
from stack.planning.outline_check import fallback_kernels
from stack.planning.parameters import PlannerParameters
from stack.planning.search import SearchLimits, StepCosts, Workspace
from stack.planning.smoothers.choice import SMOOTHERS, point_smoother, point_smoother_kernels
from stack.types import CostGrid, FailureCode, Path, Pose2D


@dataclass(frozen=True)
class AstarParameters(PlannerParameters):
    """Parameters of the A* planner."""

    cost_weight: float = parameter(
        3.0, at_least=0.0, at_most=50.0, public=True,
        help="weight of cell costs: a path costs length * (1 + cost_weight * cost / 252)",
    )  # fmt: skip
    unknown_as: float = parameter(
        126.0, at_least=0.0, at_most=252.0,
        help="cell cost assumed for unknown cells; lower values lead through them more often",
    )  # fmt: skip
    smoother: str = parameter(
        "simple", one_of=SMOOTHERS, public=True, help="smoother for the path of cells"
    )


class Astar(Planner):
    """A* on an 8-connected grid, followed by a smoother.

    A path costs its length times (1 + cost_weight · c / 252), where c is the cost of the cells it
    enters. It never enters lethal or inscribed cells and never passes between two such cells that
    touch at a corner. The search is exact: it finds a path to every reachable goal, and no cheaper
    path of cells exists (up to the rounding of costs to integers, 0.5 %).

    Args:
        parameters: weights and tolerances.
        robot: 1.3 times its inscribed radius is the least escape distance.
    """

    Parameters: ClassVar[type] = AstarParameters
    ignores_outline: ClassVar[bool] = True

    @staticmethod
    def kernels(parameters: AstarParameters, robot: RobotDescription) -> KernelTypes:
        """Return the kernels of a run with this component."""
        from stack.planning import kernels

        used = (*kernels.SEARCH, *kernels.EXTRACTION, *kernels.ENDPOINTS)
        more = fallback_kernels(robot)
        return (*used, *point_smoother_kernels(parameters.smoother), *more)

    def __init__(self, parameters: AstarParameters, robot: RobotDescription) -> None:
        from stack.planning import kernels

        super().__init__(parameters, robot)
        self._kernels: Any = kernels
        self._tables = StepCosts.of(
            parameters.cost_weight, parameters.allow_unknown, parameters.unknown_as
        )
        self._max_expansions = parameters.max_expansions
        self._endpoints = Endpoints.of(parameters, robot.footprint, self._tables.traverse)
        self._smoother = point_smoother(parameters.smoother, self._tables.traverse)
        self._workspace = Workspace(0, 0, self._tables)

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
        query = _Query(start, start_cell, goal, ends.goal_cell(costs, goal))
        target = self._search(
            costs, query, ends, SearchLimits(self._max_expansions, options.cancel)
        )
        end = goal
        if target != goal_cell:
            end = Pose2D(*costs.centre_of(*target), goal.heading)
        if start_cell == target:
            return ends.mark_partial(straight_path(start, end), goal)
        cells = self._kernels.extract(
            self._workspace.parents, costs.cells.shape[1],
            cell_index(costs, start_cell), cell_index(costs, target),
        )  # fmt: skip
        points = through_centres(costs, cells, start, end)
        return ends.mark_partial(self._smoother.smooth(costs, points, end.heading), goal)

    def _search(
        self, costs: CostGrid, query: _Query, ends: Endpoints, limits: SearchLimits
    ) -> Cell:
        """Run A*; return the target, or the reachable cell nearest to the goal."""
        stuck = self._tables.traverse[costs.cells[query.start_cell]] == 0
        reach = round(ends.escape_distance / costs.resolution) if stuck else 0
        workspace = self._workspace = self._workspace.fitting(costs)
        numbers = cell_index(costs, query.start_cell), cell_index(costs, query.target)
        if workspace.run(costs, *numbers, reach, limits):
            return query.target
        near = workspace.nearest_reached(costs, query.goal)
        if workspace.limited:
            ends.check_limited(costs, (query.start, query.goal), near, workspace.expanded)
        return ends.accept_nearest(costs, query.start, query.goal, near)


@dataclass(frozen=True)
class _Query:
    """Start and goal of a plan, with the cells that the search connects."""

    start: Pose2D
    start_cell: Cell
    goal: Pose2D
    target: Cell
