"""Any-angle planning: straight lines from corner to corner, weighed by what they cross."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from stack.description import RobotDescription
from stack.parameters import parameter
from stack.planning.endpoints import Cell, Endpoints, cell_on_map, number, straight, through_centres
from stack.planning.search import StepCosts, Workspace
from stack.planning.smoothers.choice import SMOOTHERS, point_smoother
from stack.types import CostGrid, FailureCode, Path, Pose2D

Cells = NDArray[np.int64]


@dataclass(frozen=True)
class ThetaStarParameters:
    """How Theta* weighs ways against each other."""

    euclidean_weight: float = parameter(
        1.0, above=0.0, at_most=50.0, help="what a metre counts wherever it leads"
    )
    traversal_weight: float = parameter(
        3.0, at_least=0.0, at_most=50.0,
        help="what a metre counts more where the costmap is fullest (252)",
    )  # fmt: skip
    allow_unknown: bool = parameter(True, help="plan through cells nobody has seen")
    tolerance: float = parameter(
        0.2, "m", at_least=0.0, at_most=5.0,
        help="when the goal cannot be reached, a place this near will do; 0 is exactly there",
    )  # fmt: skip
    escape_distance: float = parameter(
        0.3, "m", at_least=0.0, at_most=2.0,
        help="how far a plan may lead out of a place too near to an obstacle",
    )  # fmt: skip
    allow_partial: bool = parameter(
        False, help="when the goal cannot be reached, lead as near to it as can be"
    )
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
        from stack.planning.theta_star import kernels

        self._kernels: Any = kernels
        self._parameters = parameters
        share = parameters.traversal_weight / parameters.euclidean_weight
        self._tables = StepCosts.of(share, parameters.allow_unknown)
        self._weights = self._tables.traverse * (parameters.euclidean_weight / 100.0)
        self._endpoints = Endpoints(
            self._tables.traverse, parameters.tolerance,
            max(parameters.escape_distance, 1.3 * robot.footprint.inscribed_radius),
            parameters.allow_partial,
        )  # fmt: skip
        self._smoother = point_smoother(parameters.smoother, self._tables.traverse)

    def plan(self, costs: CostGrid, start: Pose2D, goal: Pose2D) -> Path:
        """A path of poses 5 cm apart from start to goal, both exactly, in the map frame.

        Headings follow the path, but the last one is the goal's. Where the goal cannot be reached,
        the path ends at the nearest place within the tolerance that can. A start in an inscribed or
        lethal cell is left by the cheapest way to a better cell.

        Raises:
            NavigationError: NO_VALID_PATH, START_OCCUPIED, GOAL_OCCUPIED, START_OUTSIDE_MAP or
                GOAL_OUTSIDE_MAP.
        """
        start_cell = self._endpoints.start_cell(costs, start)
        goal_cell = cell_on_map(costs, goal, "goal", FailureCode.GOAL_OUTSIDE_MAP)
        target = self._endpoints.goal_cell(costs, goal)
        way_out = self._way_out(costs, start_cell, target)
        if way_out is None:
            target, corners = start_cell, np.array([start_cell])
            target = self._endpoints.accept_nearest(costs, start, goal, None)
        else:
            target, corners = self._corners(costs, way_out[-1], start, goal, target)
            corners = np.vstack([np.array(way_out[:-1], dtype=np.int64).reshape(-1, 2), corners])
        end = goal
        if target != goal_cell:
            end = Pose2D(*costs.centre_of(*target), goal.heading)
        if start_cell == target:
            return straight(start, end)
        points = through_centres(costs, corners[1:-1], start, end)
        return self._smoother.smooth(costs, points, end.heading)

    def _way_out(self, costs: CostGrid, start: Cell, target: Cell) -> list[Cell] | None:
        """Cells from the start to the first with a way; None when there is none near."""
        if self._tables.traverse[costs.cells[start]] > 0:
            return [start]
        return leave(costs, self._tables, start, target, self._endpoints.escape_distance)

    def _corners(
        self, costs: CostGrid, begin: Cell, start: Pose2D, goal: Pose2D, target: Cell
    ) -> tuple[Cell, Cells]:
        """The cell reached, the target or the nearest to the goal, and (n, 2) corner cells."""
        kernels, columns = self._kernels, costs.cells.shape[1]
        size = costs.cells.size
        so_far = np.full(size, kernels.NOT_REACHED)
        parents, closed = np.empty(size, np.int32), np.zeros(size, np.bool_)
        found, _ = kernels.search(
            costs.cells, self._weights, float(self._weights[0]), so_far, parents, closed,
            number(costs, begin), number(costs, target),
        )  # fmt: skip
        if not found:
            x, y = costs.origin
            place = (goal.y - y) / costs.resolution, (goal.x - x) / costs.resolution
            near = int(kernels.nearest_closed(closed, columns, *place))
            target = self._endpoints.accept_nearest(costs, start, goal, divmod(near, columns))
        cells = [number(costs, target)]
        while parents[cells[-1]] != cells[-1]:
            cells.append(int(parents[cells[-1]]))
        return target, np.array([divmod(cell, columns) for cell in reversed(cells)], dtype=np.int64)


def leave(
    costs: CostGrid, tables: StepCosts, start: Cell, target: Cell, distance: float
) -> list[Cell] | None:
    """The cells by which A* leaves a start with no way, up to the first that has one.

    Args:
        costs: map frame.
        tables: step costs.
        start: a cell with no way.
        target: where the plan leads.
        distance: metres within which the way out must lie.

    Returns:
        (row, column) of the cells; None when nothing free can be reached.
    """
    from stack.planning import kernels

    extract: Any = kernels.extract
    rows, columns = costs.cells.shape
    workspace = Workspace(rows, columns, tables)
    reach, end = round(distance / costs.resolution), target
    if not workspace.run(costs, number(costs, start), number(costs, target), reach):
        near = workspace.nearest_reached(costs, Pose2D(*costs.centre_of(*target)))
        if near is None:
            return None
        end = near
    cells = extract(workspace.parents, columns, number(costs, start), number(costs, end))
    way: list[Cell] = []
    for row, column in cells.tolist():
        way.append((row, column))
        if tables.traverse[costs.cells[row, column]] > 0:
            break
    return way
