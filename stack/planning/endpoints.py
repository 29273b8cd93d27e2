"""Start and goal cells of a plan, and the errors for occupied or unreachable ones."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stack.components import PlanOptions
from stack.errors import NavigationError
from stack.planning.parameters import PlannerParameters
from stack.types import (
    INSCRIBED_COST,
    LETHAL_COST,
    UNKNOWN_COST,
    CostGrid,
    FailureCode,
    Footprint,
    Path,
    Pose2D,
)

Cell = tuple[int, int]

_HINT_REACH = 3.0  # m; search radius for the free place that an error message suggests


@dataclass(frozen=True)
class Endpoints:
    """Checks of starts and goals, and free cells near them.

    Attributes:
        traverse: (256,) cost of a step by cell cost, 0 if impassable.
        tolerance: metres; a free cell within this distance of a blocked goal is accepted.
        escape_distance: metres; longest distance to leave an occupied start.
        partial: whether a plan may end at any distance from the goal.
    """

    traverse: NDArray[np.int64]
    tolerance: float
    escape_distance: float
    partial: bool = False

    @staticmethod
    def of(
        parameters: PlannerParameters, footprint: Footprint, traverse: NDArray[np.int64]
    ) -> Endpoints:
        """Return the checks for a planner; the escape distance is at least 1.3 inscribed radii."""
        escape = max(parameters.escape_distance, 1.3 * footprint.inscribed_radius)
        return Endpoints(traverse, parameters.tolerance, escape, parameters.allow_partial)

    def with_options(self, options: PlanOptions) -> Endpoints:
        """Return these checks with the options of one plan applied."""
        return replace(self, partial=True) if options.partial and not self.partial else self

    def mark_partial(self, path: Path, goal: Pose2D) -> Path:
        """Return the path, marked partial if it ends outside the goal tolerance."""
        far = path.goal.distance_to(goal) > self.tolerance + 1e-6
        return replace(path, partial=True) if far else path

    def start_cell(self, costs: CostGrid, start: Pose2D) -> Cell:
        """Return the start's cell.

        Raises:
            NavigationError: START_OUTSIDE_MAP, or START_OCCUPIED if no cell within the escape
                distance is free.
        """
        cell = cell_on_map(costs, start, "start", FailureCode.START_OUTSIDE_MAP)
        if costs.cells[cell] == LETHAL_COST:
            if self.nearest_free(costs, start, self.escape_distance) is None:
                raise self._occupied_start(costs, start, "in an occupied cell")
        return cell

    def passable_start(self, costs: CostGrid, start: Pose2D) -> Cell:
        """Return the start's cell, or the nearest free one if that is impassable.

        Raises:
            NavigationError: START_OCCUPIED if no cell within the escape distance is free.
        """
        cell = costs.cell_at(start.x, start.y)
        if self.traverse[costs.cells[cell]] > 0:
            return cell
        near = self.nearest_free(costs, start, self.escape_distance)
        if near is None:
            raise self._occupied_start(costs, start, "too close to an obstacle")
        return near

    def _occupied_start(self, costs: CostGrid, start: Pose2D, where: str) -> NavigationError:
        return NavigationError(
            FailureCode.START_OCCUPIED,
            f"start {xy_text(start)} is {where} and no cell within "
            f"{self.escape_distance:.2f} m is free; {self.free_place(costs, start)}",
        )

    def goal_cell(self, costs: CostGrid, goal: Pose2D) -> Cell:
        """Return the goal's cell, or the nearest free cell within the tolerance.

        Raises:
            NavigationError: GOAL_OUTSIDE_MAP or GOAL_OCCUPIED.
        """
        cell = cell_on_map(costs, goal, "goal", FailureCode.GOAL_OUTSIDE_MAP)
        if self.traverse[costs.cells[cell]] > 0:
            return cell
        reach = max(costs.cells.shape) * costs.resolution if self.partial else self.tolerance
        near = self.nearest_free(costs, goal, reach)
        if near is None:
            where = _cell_text(int(costs.cells[cell]))
            raise NavigationError(
                FailureCode.GOAL_OCCUPIED,
                f"goal {xy_text(goal)} is {where}; {self.free_place(costs, goal)}",
            )
        return near

    def nearest_free(self, costs: CostGrid, pose: Pose2D, distance: float) -> Cell | None:
        """Return the passable cell nearest to a pose within a distance in metres, or None."""
        from stack.planning import kernels

        search: Any = kernels.nearest_passable
        (x, y), side = costs.origin, costs.resolution
        place = (pose.y - y) / side, (pose.x - x) / side
        row, column = search(costs.cells, self.traverse, *place, distance / side)
        return None if row < 0 else (int(row), int(column))

    def free_place(self, costs: CostGrid, pose: Pose2D) -> str:
        """Return the nearest free place as text for an error message."""
        near = self.nearest_free(costs, pose, _HINT_REACH)
        if near is None:
            return f"no place within {_HINT_REACH:g} m is free"
        x, y = costs.centre_of(*near)
        return f"the nearest free place is ({x:.2f}, {y:.2f})"

    def accept_nearest(
        self, costs: CostGrid, ends: tuple[Pose2D, Pose2D], near: Cell | None, expanded: int | None
    ) -> Cell:
        """Return the last cell of a plan whose goal was not reached.

        Args:
            costs: map frame.
            ends: start and goal.
            near: the reached cell nearest to the goal, or None.
            expanded: number of expanded cells, if the search ended at its limit.

        Raises:
            NavigationError: TIMED_OUT or NO_VALID_PATH.
        """
        start, goal = ends
        place = None if near is None else Pose2D(*costs.centre_of(*near))
        if near is not None and place is not None:
            if self.partial or goal.distance_to(place) <= self.tolerance:
                return near
        if expanded is not None:
            raise out_of_expansions(start, goal, expanded)
        if place is None:
            raise enclosed_start(start)
        raise unreachable_goal(start, goal, (place.x, place.y))


def enclosed_start(start: Pose2D) -> NavigationError:
    """Return the error for a start from which no free cell can be reached."""
    return NavigationError(
        FailureCode.NO_VALID_PATH,
        f"start {xy_text(start)} is enclosed: no free cell can be reached from it",
    )


def out_of_expansions(start: Pose2D, goal: Pose2D, expanded: int) -> NavigationError:
    """Return the error for a search that reached its limit of expansions."""
    return NavigationError(
        FailureCode.TIMED_OUT,
        f"no path from {xy_text(start)} to {xy_text(goal)} found within {expanded} expansions; "
        "raise max_expansions, or check with `treepilot doctor` that a path exists",
    )


def unreachable_goal(start: Pose2D, goal: Pose2D, nearest: tuple[float, float]) -> NavigationError:
    """Return the error for an unreachable goal; it names the nearest reachable place."""
    x, y = nearest
    return NavigationError(
        FailureCode.NO_VALID_PATH,
        f"no path from {xy_text(start)} to {xy_text(goal)}: the nearest reachable place is "
        f"({x:.2f}, {y:.2f}), {goal.distance_to(Pose2D(x, y)):.2f} m from the goal",
        place=nearest,
    )


def cell_on_map(costs: CostGrid, pose: Pose2D, what: str, code: FailureCode) -> Cell:
    """Return a pose's cell; raise NavigationError with `code` if it is outside the map."""
    cell = costs.cell_at(pose.x, pose.y)
    if not costs.contains(*cell):
        rows, columns = costs.cells.shape
        x, y = costs.origin
        right, top = x + columns * costs.resolution, y + rows * costs.resolution
        raise NavigationError(
            code,
            f"{what} {xy_text(pose)} is outside the map, which covers x {x:.2f} to {right:.2f} m "
            f"and y {y:.2f} to {top:.2f} m",
        )
    return cell


def cell_index(costs: CostGrid, cell: Cell) -> int:
    """Return a cell's index, row * columns + column."""
    return cell[0] * int(costs.cells.shape[1]) + cell[1]


def xy_text(pose: Pose2D) -> str:
    """Return a pose's position as text for an error message."""
    return f"({pose.x:.2f}, {pose.y:.2f})"


def _cell_text(cost: int) -> str:
    texts = {INSCRIBED_COST: "too close to an obstacle", UNKNOWN_COST: "in an unknown cell"}
    return texts.get(cost, "in an occupied cell")
