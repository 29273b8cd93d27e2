"""Common part of the pose planners: ends, reachability, partial plans and errors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import inf
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stack.compilation import KernelTypes
from stack.components import CancelToken, PlanOptions
from stack.errors import NavigationError
from stack.geometry.path_progress import split_at_cusps
from stack.planning.endpoints import (
    Cell,
    Endpoints,
    cell_on_map,
    out_of_expansions,
    unreachable_goal,
    xy_text,
)
from stack.planning.kinematic.search import (
    CollisionChecker,
    Drive,
    Method,
    Outcome,
    PoseSearch,
    Query,
)
from stack.planning.kinematic.shaping import Shaping
from stack.planning.search import StepCosts
from stack.planning.smoothers.choice import shape_kernels
from stack.types import CostGrid, FailureCode, Footprint, Path, Pose2D, wrap_angle

_FLOOD_MARGIN = 0.3  # the cost-to-go field covers costs this share above the start's
_PARTIAL_REACH = 3.0  # m; search radius for a clear pose near a blocked goal of a partial plan
_HEADING_TOLERANCE = 0.35  # rad; heading tolerance of an end other than the goal
_ANY_HEADING = 8  # number of headings tried near a blocked goal of a partial plan


_SAME_END = 0.02  # m and rad between the ends of two paths to the same goal

_GRAZED = 0.02
"""Share of the footprint in contact up to which a path is free. Scans with noise put a cell in the
way of most long paths through narrow doors now and then; the controller gets past.
"""


@dataclass(frozen=True)
class PosePlanning:
    """Pose planner for a footprint and a search method.

    Attributes:
        footprint: outline in the base frame.
        tables: step costs of the 2D cost-to-go field.
        endpoints: tolerances.
        shaping: smoother of the poses found.
        method: returns the search method for a grid resolution in metres.
        seeds: returns the first drives from a start pose.
    """

    footprint: Footprint
    tables: StepCosts
    endpoints: Endpoints
    shaping: Shaping
    method: Callable[[float], Method]
    seeds: Callable[[CollisionChecker, Pose2D], list[Drive]]

    def plan(self, costs: CostGrid, start: Pose2D, goal: Pose2D, options: PlanOptions) -> Path:
        """Return a collision-free path of poses from start to goal.

        Raises:
            NavigationError: as `Planner.plan`.
        """
        return replace(self, endpoints=self.endpoints.with_options(options))._plan(
            costs, start, goal, options
        )

    def _plan(self, costs: CostGrid, start: Pose2D, goal: Pose2D, options: PlanOptions) -> Path:
        cell_on_map(costs, start, "start", FailureCode.START_OUTSIDE_MAP)
        cell_on_map(costs, goal, "goal", FailureCode.GOAL_OUTSIDE_MAP)
        checker = CollisionChecker.of(costs, self.footprint, self.tables)
        options.cancel.check()
        begin = self._start_cell(checker, start)
        end = self._clear_goal(checker, goal)
        field, horizon = self._field(costs, end, begin, options.cancel)
        if field[begin] >= self._unreached:
            end = self._reachable(checker, start, goal, begin, options.cancel)
            field, horizon = self._field(costs, end, begin, options.cancel)
        contacts = checker.allowed_contacts(start)
        escape = self.endpoints.escape_distance if contacts else 0.0
        method = self.method(costs.resolution)
        query = Query(
            start, self.seeds(checker, start), end, field, horizon,
            escape, float(field[begin]), contacts, options.direction,
            _cost_of(options.current, end, method, checker),
        )  # fmt: skip
        outcome = PoseSearch(method, checker, query).run(options.cancel)
        if outcome.drive is None and query.below < inf:
            raise NavigationError(
                FailureCode.NO_VALID_PATH, "found no path cheaper than the current one"
            )
        drive = outcome.drive or self._nearest(outcome, start, goal)
        if len(drive.poses) < 2:
            drive = Drive(np.vstack([drive.poses, drive.poses]), np.zeros(2, np.int64), 0.0)
        path = self.endpoints.mark_partial(self.shaping.path(checker, drive), goal)
        turned = abs(wrap_angle(path.goal.heading - goal.heading))
        return replace(path, partial=True) if turned > _HEADING_TOLERANCE else path

    @property
    def _unreached(self) -> float:
        from stack.planning.cost_to_go import kernels

        return kernels.UNREACHED

    def _start_cell(self, checker: CollisionChecker, start: Pose2D) -> Cell:
        """Return the start's cell, or the nearest free cell if that is impassable."""
        costs = checker.costs
        cell = costs.cell_at(start.x, start.y)
        if self.tables.traverse[costs.cells[cell]] > 0:
            return cell
        near = self.endpoints.escape_cell(costs, start)
        if near is None:
            raise NavigationError(
                FailureCode.START_OCCUPIED,
                f"start {xy_text(start)} is too close to an obstacle and no cell within "
                f"{self.endpoints.escape_distance:.2f} m is free; "
                f"{self.endpoints.free_place(costs, start)}",
            )
        return near

    def _clear_goal(self, checker: CollisionChecker, goal: Pose2D) -> Pose2D:
        """Return the goal, or the nearest clear pose with its heading within the tolerance.

        A partial plan searches farther and with other headings.
        """
        if checker.contacts(goal) == 0:
            return goal
        partial = self.endpoints.partial
        reach = max(self.endpoints.tolerance, _PARTIAL_REACH if partial else 0.0)
        turns = np.arange(_ANY_HEADING) if partial else np.zeros(1)
        for x, y in _cells_around(checker.costs, goal, reach):
            for turn in turns:
                pose = Pose2D(x, y, goal.heading + float(turn) * 2.0 * np.pi / _ANY_HEADING)
                if checker.contacts(pose) == 0:
                    return pose
        raise NavigationError(
            FailureCode.GOAL_OCCUPIED,
            f"the robot does not fit at goal {xy_text(goal)} with heading {goal.heading:.2f} rad; "
            f"{self.endpoints.free_place(checker.costs, goal)}",
        )

    def _field(
        self, costs: CostGrid, goal: Pose2D, begin: Cell, cancel: CancelToken
    ) -> tuple[NDArray[np.float32], float]:
        from stack.planning.cost_to_go import kernels

        flood: Any = kernels.cost_to_go
        scale = costs.resolution / float(self.tables.traverse[0])
        field, horizon = flood(
            costs.cells, self.tables.traverse, self.tables.diagonal,
            costs.cell_at(goal.x, goal.y), begin, _FLOOD_MARGIN, scale, cancel.flag,
        )  # fmt: skip
        cancel.check()
        return field, float(horizon)

    def _reachable(
        self,
        checker: CollisionChecker,
        start: Pose2D,
        goal: Pose2D,
        begin: Cell,
        cancel: CancelToken,
    ) -> Pose2D:
        """Return the clear pose nearest to the goal that a point robot can reach."""
        costs = checker.costs
        field, _ = self._field(costs, Pose2D(*costs.centre_of(*begin)), (-1, -1), cancel)
        cells = np.argwhere(field < self._unreached)
        middles = (cells[:, ::-1] + 0.5) * costs.resolution + np.array(costs.origin)
        away = np.hypot(middles[:, 0] - goal.x, middles[:, 1] - goal.y)
        order = np.argsort(away, kind="stable")
        nearest = middles[order[0]]
        reach = inf if self.endpoints.partial else self.endpoints.tolerance
        for index in order[away[order] <= reach]:
            x, y = (float(value) for value in middles[index])
            pose = Pose2D(x, y, goal.heading)
            if checker.contacts(pose) == 0:
                return pose
        raise unreachable_goal(start, goal, (float(nearest[0]), float(nearest[1])))

    def _nearest(self, outcome: Outcome, start: Pose2D, goal: Pose2D) -> Drive:
        """Return the drive to the reached pose nearest to the goal, if it is acceptable."""
        reached = outcome.reached
        if not len(reached):
            raise NavigationError(
                FailureCode.NO_VALID_PATH,
                f"start {xy_text(start)} is enclosed: the robot cannot move away from it",
            )
        away = np.hypot(reached[:, 0] - goal.x, reached[:, 1] - goal.y)
        turned = np.abs(np.angle(np.exp(1j * (reached[:, 2] - goal.heading))))
        index = int(np.lexsort((turned, away))[0])
        near = np.flatnonzero((away <= self.endpoints.tolerance) & (turned <= _HEADING_TOLERANCE))
        if near.size:
            return outcome.drive_to(int(near[np.lexsort((turned[near], away[near]))[0]]))
        if self.endpoints.partial:
            return outcome.drive_to(index)
        if outcome.limited:
            raise out_of_expansions(start, goal, outcome.expanded)
        if away[index] <= self.endpoints.tolerance:
            raise NavigationError(
                FailureCode.NO_VALID_PATH,
                f"{xy_text(goal)} can be reached from {xy_text(start)}, but not with heading "
                f"{goal.heading:.2f} rad: the nearest reachable heading is "
                f"{reached[index, 2]:.2f} rad",
            )
        raise unreachable_goal(start, goal, (float(reached[index, 0]), float(reached[index, 1])))


def pose_planner_kernels(smoother: str) -> KernelTypes:
    """Return the kernels of a planner of poses with this smoother."""
    from stack.planning import kernels
    from stack.planning.cost_to_go.kernels import COST_TO_GO
    from stack.planning.curves.kernels import CURVES
    from stack.planning.geodesic.kernels import COSTING
    from stack.planning.kinematic.kernels import POSES

    rounding = kernels.ROUNDING if smoother == "simple" else shape_kernels(smoother)
    costing = () if smoother == "none" else COSTING
    return (*POSES, *COST_TO_GO, *CURVES, *kernels.ENDPOINTS, *rounding, *costing)


def _cells_around(costs: CostGrid, pose: Pose2D, reach: float) -> list[tuple[float, float]]:
    """Return the (x, y) centres of the cells within `reach` metres of a pose, nearest first."""
    row, column = costs.cell_at(pose.x, pose.y)
    cells = int(reach / costs.resolution) + 1
    found = []
    for rise in range(-cells, cells + 1):
        for run in range(-cells, cells + 1):
            x, y = costs.centre_of(row + rise, column + run)
            away = pose.distance_to(Pose2D(x, y))
            if away <= reach and costs.contains(row + rise, column + run):
                found.append((away, x, y))
    return [(x, y) for _, x, y in sorted(found)]


def _cost_of(path: Path | None, end: Pose2D, method: Method, checker: CollisionChecker) -> float:
    """Return the cost of a path to the end; inf without one, if it ends elsewhere or is blocked.

    It is a little too low: curves are counted as straight.
    """
    if path is None or path.partial or path.goal.distance_to(end) > _SAME_END:
        return inf
    if abs(wrap_angle(path.goal.heading - end.heading)) > _SAME_END:
        return inf
    parts, cost = split_at_cusps(path), 0.0
    for part in parts:
        cost += part.path.length * (method.penalties.reverse if part.backward else 1.0)
    mean, share = checker.judged(path.points)
    blocked = share > _GRAZED
    return inf if blocked else mean * cost + method.penalties.change * (len(parts) - 1)
