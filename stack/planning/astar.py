"""A* planner: the cheapest path on a costmap, then smoothed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from stack.compilation import KernelTypes
from stack.drivetrain.description import RobotDescription
from stack.parameters import parameter
from stack.planning.cell_planner import CellPlanner, CellPlannerParameters, CellQuery
from stack.planning.endpoints import Cell, cell_index
from stack.planning.search import StepCosts, Workspace


@dataclass(frozen=True)
class AstarParameters(CellPlannerParameters):
    """Parameters of the A* planner."""

    cost_weight: float = parameter(
        3.0, at_least=0.0, at_most=50.0, public=True,
        help="weight of cell costs: a path costs length * (1 + cost_weight * cost / 252)",
    )  # fmt: skip
    unknown_as: float = parameter(
        126.0, at_least=0.0, at_most=252.0,
        help="cell cost assumed for unknown cells; lower values lead through them more often",
    )  # fmt: skip


class Astar(CellPlanner):
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

    @staticmethod
    def kernels(parameters: AstarParameters, robot: RobotDescription) -> KernelTypes:
        from stack.planning.kernels import SEARCH

        return (*SEARCH, *CellPlanner.kernels(parameters, robot))

    def __init__(self, parameters: AstarParameters, robot: RobotDescription) -> None:
        from stack.planning import kernels

        p = parameters
        super().__init__(p, robot, StepCosts.of(p.cost_weight, p.allow_unknown, p.unknown_as))
        self._kernels: Any = kernels
        self._workspace = Workspace(0, 0, self._tables)

    def _search(self, query: CellQuery) -> tuple[Cell, NDArray[np.int64]]:
        costs, last = query.costs, query.target
        stuck = self._tables.traverse[costs.cells[query.start_cell]] == 0
        reach = round(query.ends.escape_distance / costs.resolution) if stuck else 0
        workspace = self._workspace = self._workspace.fitting(costs)
        start, target = cell_index(costs, query.start_cell), cell_index(costs, query.target)
        if not workspace.run(costs, start, target, reach, query.limits):
            near = workspace.nearest_reached(costs, query.goal)
            last = query.nearest(near, workspace.expanded if workspace.limited else None)
        columns, end = costs.cells.shape[1], cell_index(costs, last)
        return last, self._kernels.extract(workspace.parents, columns, start, end)
