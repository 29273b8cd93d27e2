"""Global planning: the cheapest way over a costmap, then smoothed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from stack.components import DEFAULT_PLAN_OPTIONS, PlanOptions
from stack.drivetrain.description import RobotDescription
from stack.parameters import parameter
from stack.planning.endpoints import Cell, Endpoints, cell_on_map, number, straight, through_centres
from stack.planning.parameters import PlannerParameters
from stack.planning.search import Effort, StepCosts, Workspace
from stack.planning.smoothers.choice import SMOOTHERS, point_smoother
from stack.types import CostGrid, FailureCode, Path, Pose2D


@dataclass(frozen=True)
class AstarParameters(PlannerParameters):
    """How A* weighs ways against each other."""

    cost_weight: float = parameter(
        3.0, at_least=0.0, at_most=50.0,
        help="how many times its length a way costs more where the costmap is fullest (252)",
    )  # fmt: skip
    unknown_as: float = parameter(
        126.0, at_least=0.0, at_most=252.0,
        help="cost that cells nobody has seen count as; less explores more",
    )  # fmt: skip
    smoother: str = parameter("simple", one_of=SMOOTHERS, help="what is done to the path of cells")


class Astar:
    """Cheapest path over an 8-connected grid, smoothed.

    A path costs its length times (1 + cost_weight · c / 252), c the cost of the cells it enters; it
    never passes lethal or inscribed cells, nor between two that touch at a corner. The search is
    exact: a reachable goal is never missed, and no cheaper path of cells exists (up to the
    rounding of costs to whole numbers, 0.5 %).

    Args:
        parameters: weights and tolerances.
        robot: its inscribed radius widens the escape distance where that is larger.
    """

    Parameters: ClassVar[type] = AstarParameters

    def __init__(self, parameters: AstarParameters, robot: RobotDescription) -> None:
        from stack.planning import kernels

        self._kernels: Any = kernels
        self._tables = StepCosts.of(
            parameters.cost_weight, parameters.allow_unknown, parameters.unknown_as
        )
        self._most = parameters.max_expansions
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
        """A path of poses 5 cm apart from start to goal, both exactly, in the map frame.

        Headings follow the path, but the last one is the goal's. Where the goal cannot be reached,
        the path ends at the nearest place within the tolerance that can. A start in an inscribed or
        lethal cell (noise, somebody close by) is left by the cheapest way to a better cell.

        Raises:
            NavigationError: NO_VALID_PATH, START_OCCUPIED, GOAL_OCCUPIED, START_OUTSIDE_MAP,
                GOAL_OUTSIDE_MAP, TIMED_OUT after max_expansions, or CANCELLED.
        """
        ends = self._endpoints.on(options)
        start_cell = ends.start_cell(costs, start)
        goal_cell = cell_on_map(costs, goal, "goal", FailureCode.GOAL_OUTSIDE_MAP)
        query = _Query(start, start_cell, goal, ends.goal_cell(costs, goal))
        target = self._search(costs, query, ends, Effort(self._most, options.cancel))
        end = goal
        if target != goal_cell:
            end = Pose2D(*costs.centre_of(*target), goal.heading)
        if start_cell == target:
            return ends.marked(straight(start, end), goal)
        cells = self._kernels.extract(
            self._workspace.parents, costs.cells.shape[1],
            number(costs, start_cell), number(costs, target),
        )  # fmt: skip
        points = through_centres(costs, cells, start, end)
        return ends.marked(self._smoother.smooth(costs, points, end.heading), goal)

    def _search(self, costs: CostGrid, query: _Query, ends: Endpoints, effort: Effort) -> Cell:
        """Run A*; the cell it reached: the target, or the nearest reachable one to the goal."""
        stuck = self._tables.traverse[costs.cells[query.start_cell]] == 0
        reach = round(ends.escape_distance / costs.resolution) if stuck else 0
        workspace = self._workspace = self._workspace.fitting(costs)
        numbers = number(costs, query.start_cell), number(costs, query.target)
        if workspace.run(costs, *numbers, reach, effort):
            return query.target
        near = workspace.nearest_reached(costs, query.goal)
        if workspace.limited:
            ends.check_limited(costs, (query.start, query.goal), near, workspace.expanded)
        return ends.accept_nearest(costs, query.start, query.goal, near)


@dataclass(frozen=True)
class _Query:
    """A plan to be made, with the cells to search from and to."""

    start: Pose2D
    start_cell: Cell
    goal: Pose2D
    target: Cell
