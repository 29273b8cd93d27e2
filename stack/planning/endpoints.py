"""Where plans begin and end on a costmap, and what is said when that is no place to be."""

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
    FloatArray,
    Footprint,
    Path,
    Pose2D,
)

Cell = tuple[int, int]

_HINT_REACH = 3.0  # m; how far a failure's sentence looks for a free place


@dataclass(frozen=True)
class Endpoints:
    """Checks starts and goals, and finds free places near them.

    Attributes:
        traverse: (256,) cost of a step by cell cost, 0 for no way.
        tolerance: metres; a free place this near to a blocked goal will do.
        escape_distance: metres that a plan may lead out of a bad start.
        partial: whether a place at any distance from the goal will do.
    """

    traverse: NDArray[np.int64]
    tolerance: float
    escape_distance: float
    partial: bool = False

    @staticmethod
    def of(
        parameters: PlannerParameters, footprint: Footprint, traverse: NDArray[np.int64]
    ) -> Endpoints:
        """As a planner's parameters say; a robot gets out of at least its own width."""
        escape = max(parameters.escape_distance, 1.3 * footprint.inscribed_radius)
        return Endpoints(traverse, parameters.tolerance, escape, parameters.allow_partial)

    def on(self, options: PlanOptions) -> Endpoints:
        """The same where a plan is asked for on terms of its own."""
        return replace(self, partial=True) if options.partial and not self.partial else self

    def marked(self, path: Path, goal: Pose2D) -> Path:
        """The path, said to be partial where it ends farther from the goal than is tolerated."""
        far = path.goal.distance_to(goal) > self.tolerance + 1e-6
        return replace(path, partial=True) if far else path

    def start_cell(self, costs: CostGrid, start: Pose2D) -> Cell:
        """The start's cell.

        Raises:
            NavigationError: START_OUTSIDE_MAP, or START_OCCUPIED with nothing free near.
        """
        cell = cell_on_map(costs, start, "start", FailureCode.START_OUTSIDE_MAP)
        if costs.cells[cell] == LETHAL_COST and self.escape_cell(costs, start) is None:
            raise NavigationError(
                FailureCode.START_OCCUPIED,
                f"start {text(start)} lies in an occupied cell and no cell within "
                f"{self.escape_distance:.2f} m is free; {self.free_place(costs, start)}",
            )
        return cell

    def goal_cell(self, costs: CostGrid, goal: Pose2D) -> Cell:
        """The goal's cell, or the nearest free one within the tolerance.

        Raises:
            NavigationError: GOAL_OUTSIDE_MAP or GOAL_OCCUPIED.
        """
        cell = cell_on_map(costs, goal, "goal", FailureCode.GOAL_OUTSIDE_MAP)
        if self.traverse[costs.cells[cell]] > 0:
            return cell
        reach = max(costs.cells.shape) * costs.resolution if self.partial else self.tolerance
        near = self.nearest_free(costs, goal, reach)
        if near is None:
            word = _word(int(costs.cells[cell]))
            raise NavigationError(
                FailureCode.GOAL_OCCUPIED,
                f"goal {text(goal)} lies in {word} cell; {self.free_place(costs, goal)}",
            )
        return near

    def escape_cell(self, costs: CostGrid, start: Pose2D) -> Cell | None:
        """The nearest free cell to a start, within the escape distance."""
        return self.nearest_free(costs, start, self.escape_distance)

    def nearest_free(self, costs: CostGrid, pose: Pose2D, distance: float) -> Cell | None:
        """The nearest cell with a way within a distance in metres."""
        from stack.planning import kernels

        search: Any = kernels.nearest_passable
        row, column = search(
            costs.cells, self.traverse, *in_cells(costs, pose), distance / costs.resolution
        )
        return None if row < 0 else (int(row), int(column))

    def free_place(self, costs: CostGrid, pose: Pose2D) -> str:
        """Words that name the nearest free place."""
        near = self.nearest_free(costs, pose, _HINT_REACH)
        if near is None:
            return f"no place within {_HINT_REACH:g} m is free"
        x, y = costs.centre_of(*near)
        return f"nearest free place ({x:.2f}, {y:.2f})"

    def accept_nearest(
        self, costs: CostGrid, start: Pose2D, goal: Pose2D, near: Cell | None
    ) -> Cell:
        """The cell to end in when the goal cannot be reached.

        Args:
            costs: map frame.
            start: where the plan begins.
            goal: that cannot be reached.
            near: the nearest cell to it that can, or None.

        Raises:
            NavigationError: NO_VALID_PATH.
        """
        if near is None:
            raise shut_in(start)
        if not self._will_do(costs, goal, near):
            raise no_way(start, goal, costs.centre_of(*near))
        return near

    def check_limited(
        self, costs: CostGrid, ends: tuple[Pose2D, Pose2D], near: Cell | None, expanded: int
    ) -> None:
        """Raise TIMED_OUT for a search that ran out of expansions, unless what it has will do.

        Args:
            costs: map frame.
            ends: start and goal.
            near: the nearest cell to the goal that was reached until then.
            expanded: cells, until then.
        """
        if near is None or not self._will_do(costs, ends[1], near):
            raise out_of_expansions(*ends, expanded)

    def _will_do(self, costs: CostGrid, goal: Pose2D, near: Cell) -> bool:
        """Whether a plan may end in a cell instead of at the goal."""
        distance = goal.distance_to(Pose2D(*costs.centre_of(*near)))
        return self.partial or distance <= self.tolerance


def shut_in(start: Pose2D) -> NavigationError:
    """The failure of a start from which nothing can be reached."""
    return NavigationError(
        FailureCode.NO_VALID_PATH,
        f"start {text(start)} is shut in: nothing free can be reached from it",
    )


def out_of_expansions(start: Pose2D, goal: Pose2D, expanded: int) -> NavigationError:
    """The failure of a search that was still at work when its limit came."""
    return NavigationError(
        FailureCode.TIMED_OUT,
        f"no way from {text(start)} to {text(goal)} found within {expanded} expansions; raise "
        "max_expansions, or look with `treepilot doctor` whether there is one",
    )


def no_way(start: Pose2D, goal: Pose2D, nearest: tuple[float, float]) -> NavigationError:
    """The failure that names the nearest place that can be reached."""
    x, y = nearest
    return NavigationError(
        FailureCode.NO_VALID_PATH,
        f"no way from {text(start)} to {text(goal)}: the nearest place that can be "
        f"reached is ({x:.2f}, {y:.2f}), {goal.distance_to(Pose2D(x, y)):.2f} m from the goal",
    )


def cell_on_map(costs: CostGrid, pose: Pose2D, what: str, code: FailureCode) -> Cell:
    """A pose's cell; raises NavigationError with this code off the map."""
    cell = costs.cell_at(pose.x, pose.y)
    if not costs.contains(*cell):
        rows, columns = costs.cells.shape
        x, y = costs.origin
        right, top = x + columns * costs.resolution, y + rows * costs.resolution
        raise NavigationError(
            code,
            f"{what} {text(pose)} lies outside the map, which covers x {x:.2f} to {right:.2f} m "
            f"and y {y:.2f} to {top:.2f} m",
        )
    return cell


def through_centres(
    costs: CostGrid, cells: NDArray[np.int64], start: Pose2D, end: Pose2D
) -> FloatArray:
    """(n, 2) start, the middles of the cells, end."""
    middles = (cells[:, ::-1] + 0.5) * costs.resolution + np.array(costs.origin)
    return np.vstack([(start.x, start.y), middles, (end.x, end.y)])


def straight(start: Pose2D, goal: Pose2D) -> Path:
    """Two poses, for a start and a goal in one cell."""
    apart = start.distance_to(goal) > 0.0
    heading = start.bearing_to(goal) if apart else goal.heading
    return Path(np.array([[start.x, start.y, heading], [goal.x, goal.y, goal.heading]]))


def in_cells(costs: CostGrid, pose: Pose2D) -> tuple[float, float]:
    """(row, column) of a place in fractions of cells."""
    x, y = costs.origin
    return (pose.y - y) / costs.resolution, (pose.x - x) / costs.resolution


def number(costs: CostGrid, cell: Cell) -> int:
    """A cell's number, row by row."""
    return cell[0] * int(costs.cells.shape[1]) + cell[1]


def text(pose: Pose2D) -> str:
    """A place in words."""
    return f"({pose.x:.2f}, {pose.y:.2f})"


def _word(cost: int) -> str:
    words = {INSCRIBED_COST: "a too narrow", UNKNOWN_COST: "an unknown"}
    return words.get(cost, "an occupied")
