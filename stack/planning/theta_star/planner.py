"""Theta* planner: any-angle paths, weighted by the costs of the cells that they cross."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from stack.compilation import KernelTypes
from stack.drivetrain.description import RobotDescription
from stack.parameters import parameter
from stack.planning.cell_planner import CellPlanner, CellPlannerParameters, CellQuery
from stack.planning.endpoints import Cell, cell_index, enclosed_start
from stack.planning.search import StepCosts, Workspace, nearest_marked
from stack.types import FloatArray, Pose2D


@dataclass(frozen=True)
class ThetaStarParameters(CellPlannerParameters):
    """Parameters of the Theta* planner."""

    euclidean_weight: float = parameter(
        1.0, above=0.0, at_most=50.0, help="cost of a metre over free cells"
    )
    traversal_weight: float = parameter(
        3.0, at_least=0.0, at_most=50.0,
        help="extra cost of a metre at the highest passable cell cost (252)",
    )  # fmt: skip


class ThetaStar(CellPlanner):
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

    @staticmethod
    def kernels(parameters: ThetaStarParameters, robot: RobotDescription) -> KernelTypes:
        from stack.planning.theta_star.kernels import SEARCH

        return (*SEARCH, *CellPlanner.kernels(parameters, robot))

    def __init__(self, parameters: ThetaStarParameters, robot: RobotDescription) -> None:
        share = parameters.traversal_weight / parameters.euclidean_weight
        super().__init__(parameters, robot, StepCosts.of(share, parameters.allow_unknown))
        self._weights: FloatArray = self._tables.traverse.astype(np.float64) * (
            parameters.euclidean_weight / 100.0
        )

    def _search(self, query: CellQuery) -> tuple[Cell, NDArray[np.int64]]:
        from stack.planning.theta_star import kernels

        costs, last = query.costs, query.target
        escape_path = self._escape_path(query)
        if not escape_path:
            raise enclosed_start(query.start)
        search: Any = kernels.search
        size, columns = costs.cells.size, int(costs.cells.shape[1])
        so_far = np.full(size, kernels.NOT_REACHED)
        parents, closed = np.empty(size, np.int32), np.zeros(size, np.bool_)
        status, expanded = search(
            costs.cells, self._weights, float(self._weights[0]), so_far, parents, closed,
            cell_index(costs, escape_path[-1]), cell_index(costs, last),
            query.limits.max_expansions, query.limits.cancel.flag,
        )  # fmt: skip
        query.limits.cancel.check()
        if status != kernels.FOUND:
            limited = int(expanded) if status == kernels.LIMIT else None
            last = query.nearest(nearest_marked(costs, closed, query.goal), limited)
        cells = [cell_index(costs, last)]
        while parents[cells[-1]] != cells[-1]:
            cells.append(int(parents[cells[-1]]))
        corners = [divmod(cell, columns) for cell in reversed(cells)]
        whole = np.array([*escape_path[:-1], *corners], dtype=np.int64)
        return last, whole[1:-1]

    def _escape_path(self, query: CellQuery) -> list[Cell]:
        """Return the cells of A*'s path from an impassable start to the first passable cell.

        Returns only the start if it is passable, and nothing if no passable cell can be reached.
        """
        tables, costs, end = self._tables, query.costs, query.target
        if tables.traverse[costs.cells[query.start_cell]] > 0:
            return [query.start_cell]
        from stack.planning import kernels

        extract: Any = kernels.extract
        rows, columns = costs.cells.shape
        workspace = Workspace(rows, columns, tables)
        reach = round(self._endpoints.escape_distance / costs.resolution)
        begin = cell_index(costs, query.start_cell)
        if not workspace.run(costs, begin, cell_index(costs, end), reach, query.limits):
            near = workspace.nearest_reached(costs, Pose2D(*costs.centre_of(*end)))
            if near is None:
                return []
            end = near
        cells = extract(workspace.parents, columns, begin, cell_index(costs, end))
        path = [(int(row), int(column)) for row, column in cells]
        free = [n for n, cell in enumerate(path) if tables.traverse[costs.cells[cell]] > 0]
        return path[: free[0] + 1] if free else path
