"""Base class of the pose planners: ends, reachability, partial plans and errors."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import replace
from functools import cache
from math import inf
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stack.compilation import KernelTypes
from stack.components import DEFAULT_PLAN_OPTIONS, CancelToken, Planner, PlanOptions
from stack.drivetrain.description import RobotDescription
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
from stack.planning.kinematic.moves import Penalties
from stack.planning.kinematic.search import (
    CollisionChecker,
    KinematicSearch,
    PoseDrive,
    PoseQuery,
    SearchMethod,
    SearchOutcome,
)
from stack.planning.kinematic.shaping import Shaping
from stack.planning.search import StepCosts
from stack.planning.smoothers.choice import shape_kernels
from stack.types import CostGrid, FailureCode, Path, Pose2D, wrap_angle

_FLOOD_MARGIN = 0.3  # the cost-to-go field covers costs this share above the start's
_PARTIAL_REACH = 3.0  # m; search radius for a clear pose near a blocked goal of a partial plan
_HEADING_TOLERANCE = 0.35  # rad; heading tolerance of an end other than the goal
_ANY_HEADING = 8  # number of headings tried near a blocked goal of a partial plan


_SAME_END = 0.02  # m and rad between the ends of two paths to the same goal

_GRAZED_SHARE = 0.02
"""Share of the footprint in contact up to which a path is free. Scans with noise put a cell in the
way of most long paths through narrow doors now and then; the controller gets past.
"""


class PosePlanner(Planner):
    """Searches over poses with motion primitives, and smooths what it has found.

    Subclasses choose the moves.

    Args:
        parameters: weights and tolerances.
        robot: its footprint stays clear of lethal cells, its base of inscribed ones.
        radius: minimum turning radius of the path, metres.
        penalties: of the moves.
    """

    def __init__(
        self, parameters: Any, robot: RobotDescription, radius: float, penalties: Penalties
    ) -> None:
        super().__init__(parameters, robot)
        self._footprint, self._radius, self._penalties = robot.footprint, radius, penalties
        self._tables = StepCosts.of(parameters.cost_weight, parameters.allow_unknown)
        traverse = self._tables.traverse
        self._endpoints = Endpoints.of(parameters, robot.footprint, traverse)
        self._shaping = Shaping(parameters.smoother, radius, traverse)
        self._method = cache(self._new_method)

    @staticmethod
    def kernels(parameters: Any, robot: RobotDescription) -> KernelTypes:
        return pose_planner_kernels(parameters.smoother)

    @abstractmethod
    def _new_method(self, resolution: float) -> SearchMethod:
        """Return the search method for cells of a side in metres."""

    def _seeds(self, checker: CollisionChecker, start: Pose2D) -> list[PoseDrive]:
        """Return the first drives: the start itself, for vehicles that cannot turn in place."""
        pose = np.array([[start.x, start.y, start.heading]])
        return [PoseDrive(pose, np.zeros(1, np.int64), 0.0)]

    def plan(
        self,
        costs: CostGrid,
        start: Pose2D,
        goal: Pose2D,
        options: PlanOptions = DEFAULT_PLAN_OPTIONS,
    ) -> Path:
        """Return poses at most a cell apart from exactly the start to exactly the goal, map frame.

        A turn in place is a corner of the path. If the goal cannot be reached, the path ends at
        the nearest pose within the tolerance.

        Raises:
            NavigationError: NO_VALID_PATH, START_OCCUPIED, GOAL_OCCUPIED, START_OUTSIDE_MAP,
                GOAL_OUTSIDE_MAP, TIMED_OUT after max_expansions, or CANCELLED.
        """
        from stack.planning.kinematic import kernels

        ends = self._endpoints.with_options(options)
        cell_on_map(costs, start, "start", FailureCode.START_OUTSIDE_MAP)
        cell_on_map(costs, goal, "goal", FailureCode.GOAL_OUTSIDE_MAP)
        checker = CollisionChecker.of(costs, self._footprint, self._tables)
        options.cancel.check()
        begin = ends.passable_start(costs, start)
        end = _clear_goal(ends, checker, goal)
        field, horizon = self._field(costs, end, begin, options.cancel)
        if field[begin] >= self._unreached:
            end = self._reachable(ends, checker, (start, goal), begin, options.cancel)
            field, horizon = self._field(costs, end, begin, options.cancel)
        contacts = checker.allowed_contacts(start)
        escape = ends.escape_distance if contacts else 0.0
        method = self._method(costs.resolution)
        target = kernels.Target(
            np.array([end.x, end.y, end.heading]), field, horizon, method.table, method.table_step,
            method.table_slack, method.ratio, np.array([start.x, start.y]), escape,
            float(field[begin]), contacts,
        )  # fmt: skip
        below = _cost_of(options.current, end, method, checker)
        query = PoseQuery(self._seeds(checker, start), target, options.direction, below)
        outcome = KinematicSearch(method, checker, query).run(options.cancel)
        if outcome.drive is None and query.below < inf:
            raise NavigationError(
                FailureCode.NO_VALID_PATH, "found no path cheaper than the current one"
            )
        drive = outcome.drive or _nearest(ends, outcome, start, goal)
        if len(drive.poses) < 2:
            drive = PoseDrive(np.vstack([drive.poses, drive.poses]), np.zeros(2, np.int64), 0.0)
        path = ends.mark_partial(self._shaping.path(checker, drive), goal)
        turned = abs(wrap_angle(path.goal.heading - goal.heading))
        return replace(path, partial=True) if turned > _HEADING_TOLERANCE else path

    @property
    def _unreached(self) -> float:
        from stack.planning.cost_to_go import kernels

        return kernels.UNREACHED

    def _field(
        self, costs: CostGrid, goal: Pose2D, begin: Cell, cancel: CancelToken
    ) -> tuple[NDArray[np.float32], float]:
        from stack.planning.cost_to_go import kernels

        flood: Any = kernels.cost_to_go
        scale = costs.resolution / float(self._tables.traverse[0])
        field, horizon = flood(
            costs.cells, self._tables.traverse, self._tables.diagonal,
            costs.cell_at(goal.x, goal.y), begin, _FLOOD_MARGIN, scale, cancel.flag,
        )  # fmt: skip
        cancel.check()
        return field, float(horizon)

    def _reachable(
        self, ends: Endpoints, checker: CollisionChecker, asked: tuple[Pose2D, Pose2D], begin: Cell,
        cancel: CancelToken,
    ) -> Pose2D:  # fmt: skip
        """Return the clear pose nearest to the goal, asked for with the start, that is reachable.

        Reachable for a point robot.
        """
        costs, (start, goal) = checker.costs, asked
        field, _ = self._field(costs, Pose2D(*costs.centre_of(*begin)), (-1, -1), cancel)
        cells = np.argwhere(field < self._unreached)
        middles = (cells[:, ::-1] + 0.5) * costs.resolution + np.array(costs.origin)
        away = np.hypot(middles[:, 0] - goal.x, middles[:, 1] - goal.y)
        order = np.argsort(away, kind="stable")
        nearest = middles[order[0]]
        reach = inf if ends.partial else ends.tolerance
        for index in order[away[order] <= reach]:
            x, y = (float(value) for value in middles[index])
            pose = Pose2D(x, y, goal.heading)
            if checker.contacts(pose) == 0:
                return pose
        raise unreachable_goal(start, goal, (float(nearest[0]), float(nearest[1])))


def pose_planner_kernels(smoother: str) -> KernelTypes:
    """Return the kernels of a planner of poses with this smoother."""
    from stack.planning import kernels
    from stack.planning.cost_to_go.kernels import COST_TO_GO
    from stack.planning.curves.kernels import CURVES
    from stack.planning.geodesic.kernels import COSTING
    from stack.planning.kinematic.contact.kernels import CONTACTS
    from stack.planning.kinematic.kernels import POSES

    rounding = kernels.ROUNDING if smoother == "simple" else shape_kernels(smoother)
    costing = () if smoother == "none" else COSTING
    return (*CONTACTS, *POSES, *COST_TO_GO, *CURVES, *kernels.ENDPOINTS, *rounding, *costing)


def _clear_goal(ends: Endpoints, checker: CollisionChecker, goal: Pose2D) -> Pose2D:
    """Return the goal, or the nearest clear pose with its heading within the tolerance.

    A partial plan searches farther and with other headings.
    """
    if checker.contacts(goal) == 0:
        return goal
    partial = ends.partial
    reach = max(ends.tolerance, _PARTIAL_REACH if partial else 0.0)
    turns = np.arange(_ANY_HEADING) if partial else np.zeros(1)
    for x, y in _cells_around(checker.costs, goal, reach):
        for turn in turns:
            pose = Pose2D(x, y, goal.heading + float(turn) * 2.0 * np.pi / _ANY_HEADING)
            if checker.contacts(pose) == 0:
                return pose
    raise NavigationError(
        FailureCode.GOAL_OCCUPIED,
        f"the robot does not fit at goal {xy_text(goal)} with heading {goal.heading:.2f} rad; "
        f"{ends.free_place(checker.costs, goal)}",
    )


def _nearest(ends: Endpoints, outcome: SearchOutcome, start: Pose2D, goal: Pose2D) -> PoseDrive:
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
    near = np.flatnonzero((away <= ends.tolerance) & (turned <= _HEADING_TOLERANCE))
    if near.size:
        return outcome.drive_to(int(near[np.lexsort((turned[near], away[near]))[0]]))
    if ends.partial:
        return outcome.drive_to(index)
    if outcome.limited:
        raise out_of_expansions(start, goal, outcome.expanded)
    if away[index] <= ends.tolerance:
        raise NavigationError(
            FailureCode.NO_VALID_PATH,
            f"{xy_text(goal)} can be reached from {xy_text(start)}, but not with heading "
            f"{goal.heading:.2f} rad: the nearest reachable heading is "
            f"{reached[index, 2]:.2f} rad",
        )
    raise unreachable_goal(start, goal, (float(reached[index, 0]), float(reached[index, 1])))


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


def _cost_of(
    path: Path | None, end: Pose2D, method: SearchMethod, checker: CollisionChecker
) -> float:
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
    blocked = share > _GRAZED_SHARE
    return inf if blocked else mean * cost + method.penalties.change * (len(parts) - 1)
