"""Global planning: the cheapest way over a costmap, then smoothed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from stack.description import RobotDescription
from stack.errors import NavigationError
from stack.parameters import parameter
from stack.planning.search import StepCosts, Workspace
from stack.planning.smoothing import Smoother, unsmoothed
from stack.types import (
    INSCRIBED_COST,
    LETHAL_COST,
    UNKNOWN_COST,
    CostGrid,
    FailureCode,
    FloatArray,
    Path,
    Pose2D,
)

Cell = tuple[int, int]

_HINT_REACH = 3.0  # m; how far a failure's sentence looks for a free place


@dataclass(frozen=True)
class AstarParameters:
    """How A* weighs ways against each other."""

    cost_weight: float = parameter(
        3.0, at_least=0.0, at_most=50.0,
        help="how many times its length a way costs more where the costmap is fullest (252)",
    )  # fmt: skip
    allow_unknown: bool = parameter(True, help="plan through cells nobody has seen")
    unknown_as: float = parameter(
        126.0, at_least=0.0, at_most=252.0,
        help="cost that cells nobody has seen count as; less explores more",
    )  # fmt: skip
    tolerance: float = parameter(
        0.2, "m", at_least=0.0, at_most=5.0,
        help="when the goal cannot be reached, a place this near will do; 0 is exactly there",
    )  # fmt: skip
    escape_distance: float = parameter(
        0.3, "m", at_least=0.0, at_most=2.0,
        help="how far a plan may lead out of a place too near to an obstacle",
    )  # fmt: skip
    smooth: bool = parameter(True, help="straighten and round the path of cells")


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
        self._parameters = parameters
        self._escape_distance = max(
            parameters.escape_distance, 1.3 * robot.footprint.inscribed_radius
        )
        self._tables = StepCosts.of(
            parameters.cost_weight, parameters.allow_unknown, parameters.unknown_as
        )
        self._smoother = Smoother(self._tables.traverse)
        self._workspace = Workspace(0, 0, self._tables)

    def plan(self, costs: CostGrid, start: Pose2D, goal: Pose2D) -> Path:
        """A path of poses 5 cm apart from start to goal, both exactly, in the map frame.

        Headings follow the path, but the last one is the goal's. Where the goal cannot be reached,
        the path ends at the nearest place within the tolerance that can. A start in an inscribed or
        lethal cell (noise, somebody close by) is left by the cheapest way to a better cell.

        Raises:
            NavigationError: NO_VALID_PATH, START_OCCUPIED, GOAL_OCCUPIED, START_OUTSIDE_MAP or
                GOAL_OUTSIDE_MAP.
        """
        start_cell = _cell_on_map(costs, start, "start", FailureCode.START_OUTSIDE_MAP)
        goal_cell = _cell_on_map(costs, goal, "goal", FailureCode.GOAL_OUTSIDE_MAP)
        self._check_start(costs, start, start_cell)
        target = self._free_goal(costs, goal, goal_cell)
        target = self._search(costs, start, start_cell, goal, target)
        end = goal
        if target != goal_cell:
            end = Pose2D(*costs.centre_of(*target), goal.heading)
        if start_cell == target:
            return _straight(start, end)
        cells = self._kernels.extract(
            self._workspace.parents, costs.cells.shape[1],
            _number(costs, start_cell), _number(costs, target),
        )  # fmt: skip
        points = _through_centres(costs, cells, start, end)
        if not self._parameters.smooth:
            return unsmoothed(points, end.heading)
        return self._smoother.smooth(costs, points, end.heading)

    def _check_start(self, costs: CostGrid, start: Pose2D, cell: Cell) -> None:
        if costs.cells[cell] != LETHAL_COST:
            return
        if self._nearest_free(costs, start, self._escape_distance) is None:
            raise NavigationError(
                FailureCode.START_OCCUPIED,
                f"start {_text(start)} lies in an occupied cell and no cell within "
                f"{self._escape_distance:.2f} m is free; {self._free_place(costs, start)}",
            )

    def _free_goal(self, costs: CostGrid, goal: Pose2D, cell: Cell) -> Cell:
        """The goal's cell, or the nearest free one within the tolerance."""
        if self._tables.traverse[costs.cells[cell]] > 0:
            return cell
        near = self._nearest_free(costs, goal, self._parameters.tolerance)
        if near is None:
            word = _word(int(costs.cells[cell]))
            raise NavigationError(
                FailureCode.GOAL_OCCUPIED,
                f"goal {_text(goal)} lies in {word} cell; {self._free_place(costs, goal)}",
            )
        return near

    def _search(
        self, costs: CostGrid, start: Pose2D, start_cell: Cell, goal: Pose2D, target: Cell
    ) -> Cell:
        """Run A*; the cell it reached: the target, or the nearest reachable one to the goal."""
        stuck = self._tables.traverse[costs.cells[start_cell]] == 0
        reach = round(self._escape_distance / costs.resolution) if stuck else 0
        self._workspace = self._workspace.fitting(costs)
        if self._workspace.run(costs, _number(costs, start_cell), _number(costs, target), reach):
            return target
        place = _in_cells(costs, goal)
        workspace = self._workspace
        near = self._kernels.nearest_reached(
            costs.cells, self._tables.traverse, workspace.reached, workspace.base, workspace.limit,
            *place,
        )  # fmt: skip
        if near[0] < 0:
            raise NavigationError(
                FailureCode.NO_VALID_PATH,
                f"start {_text(start)} is shut in: nothing free can be reached from it",
            )
        x, y = costs.centre_of(*near)
        distance = goal.distance_to(Pose2D(x, y))
        if distance > self._parameters.tolerance:
            raise NavigationError(
                FailureCode.NO_VALID_PATH,
                f"no way from {_text(start)} to {_text(goal)}: the nearest place that can be "
                f"reached is ({x:.2f}, {y:.2f}), {distance:.2f} m from the goal",
            )
        return int(near[0]), int(near[1])

    def _nearest_free(self, costs: CostGrid, pose: Pose2D, distance: float) -> Cell | None:
        row, column = self._kernels.nearest_passable(
            costs.cells, self._tables.traverse, *_in_cells(costs, pose), distance / costs.resolution
        )
        return None if row < 0 else (int(row), int(column))

    def _free_place(self, costs: CostGrid, pose: Pose2D) -> str:
        near = self._nearest_free(costs, pose, _HINT_REACH)
        if near is None:
            return f"no place within {_HINT_REACH:g} m is free"
        x, y = costs.centre_of(*near)
        return f"nearest free place ({x:.2f}, {y:.2f})"


def _cell_on_map(costs: CostGrid, pose: Pose2D, what: str, code: FailureCode) -> Cell:
    cell = costs.cell_at(pose.x, pose.y)
    if not costs.contains(*cell):
        rows, columns = costs.cells.shape
        x, y = costs.origin
        right, top = x + columns * costs.resolution, y + rows * costs.resolution
        raise NavigationError(
            code,
            f"{what} {_text(pose)} lies outside the map, which covers x {x:.2f} to {right:.2f} m "
            f"and y {y:.2f} to {top:.2f} m",
        )
    return cell


def _through_centres(
    costs: CostGrid, cells: NDArray[np.int64], start: Pose2D, end: Pose2D
) -> FloatArray:
    """(n, 2) start, the middles of the cells, end."""
    middles = (cells[:, ::-1] + 0.5) * costs.resolution + np.array(costs.origin)
    return np.vstack([(start.x, start.y), middles, (end.x, end.y)])


def _straight(start: Pose2D, goal: Pose2D) -> Path:
    """Two poses, for a start and a goal in one cell."""
    apart = start.distance_to(goal) > 0.0
    heading = start.bearing_to(goal) if apart else goal.heading
    return Path(np.array([[start.x, start.y, heading], [goal.x, goal.y, goal.heading]]))


def _in_cells(costs: CostGrid, pose: Pose2D) -> tuple[float, float]:
    """(row, column) of a place in fractions of cells."""
    x, y = costs.origin
    return (pose.y - y) / costs.resolution, (pose.x - x) / costs.resolution


def _number(costs: CostGrid, cell: Cell) -> int:
    return cell[0] * int(costs.cells.shape[1]) + cell[1]


def _text(pose: Pose2D) -> str:
    return f"({pose.x:.2f}, {pose.y:.2f})"


def _word(cost: int) -> str:
    words = {INSCRIBED_COST: "a too narrow", UNKNOWN_COST: "an unknown"}
    return words.get(cost, "an occupied")
