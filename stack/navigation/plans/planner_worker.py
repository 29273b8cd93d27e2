"""Plans of drives outside the control loop, used at a fixed latency.

A cancelled search stops within a fraction of a millisecond, so that the next one starts without
delay; its progress does not affect any result.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from stack.components import CancelToken, Planner, PlanOptions
from stack.navigation.plans.deferred import Deferral, Deferred, DeferringWorker
from stack.types import CostGrid, FloatArray, Path, Pose2D


@dataclass(frozen=True, slots=True)
class Plan:
    """A path through one or more goals.

    Attributes:
        path: map frame.
        leg_ends: metres along the path at which each goal lies; the last is its length.
    """

    path: Path
    leg_ends: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class PlanRequest:
    """Input of a plan: costs (not modified before the plan is over), start and goals, map frame.

    Attributes:
        partial: if a goal is not reachable, plan to the nearest reachable pose.
        direction: +1 or -1 while the robot drives forward or backward, 0 while it stands.
        current: the rest of the path that the robot follows, if only a better one is of use.
    """

    costs: CostGrid
    start: Pose2D
    goals: tuple[Pose2D, ...]
    partial: bool = False
    direction: int = 0
    current: Path | None = None


class PlanFuture(Deferred[Plan]):
    """Handle of a requested plan.

    Args:
        request: of the plan.
        job: that plans.
        cancel: stops the search.
        due: time from which the plan is used, seconds on the robot's clock.
        deferral: how it is waited for.
    """

    def __init__(
        self, request: PlanRequest, job: Future[Plan], cancel: CancelToken, due: float,
        deferral: Deferral,
    ) -> None:  # fmt: skip
        super().__init__(job, due, deferral)
        self.request, self._cancel = request, cancel

    def drop(self) -> None:
        """Cancel the plan; a search that has started stops."""
        self._cancel.request()
        super().drop()


class PlannerWorker(DeferringWorker):
    """Plans requests one at a time in its own thread.

    Attributes:
        planner: may be replaced; open requests keep their planner.
    """

    def __init__(
        self, planner: Planner, log: Callable[[str], None] = lambda _: None, *,
        is_real_time: bool = False,
    ) -> None:  # fmt: skip
        super().__init__("the planner", log, is_real_time=is_real_time)
        self.planner = planner

    def ask(
        self, request: PlanRequest, due: float, *, over: Callable[[], None] = lambda: None
    ) -> PlanFuture:
        """Submit a request whose plan is due at time `due` (seconds, robot's clock).

        Args:
            request: to plan.
            due: time from which the result is available.
            over: called once nobody reads the request's costs any more, from any thread.
        """
        cancel = CancelToken()
        job = self.deferral.worker.submit(partial(plan_through, self.planner, request, cancel))
        job.add_done_callback(lambda _: over())
        return self.keep(PlanFuture(request, job, cancel, due, self.deferral))

    def use(self, planner: Planner) -> None:
        """Plan with another planner from now on."""
        self.planner = planner


def plan_through(planner: Planner, request: PlanRequest, cancel: CancelToken | None = None) -> Plan:
    """Plan from goal to goal and join the legs.

    Planners that plan headings pass each goal with its heading, so that the joins are smooth; a
    change of the driving direction at a goal has its usual cost.

    Raises:
        NavigationError: a leg cannot be planned, or CANCELLED.
    """
    cancel = cancel or CancelToken()
    current = request.current if len(request.goals) == 1 else None
    options = PlanOptions(request.partial, request.direction, cancel, current)
    start, legs = request.start, list[Path]()
    for goal in request.goals:
        cancel.check()
        path = planner.plan(request.costs, start, goal, options=options)
        legs.append(path)
        start, options = path.goal, replace(options, direction=last_direction(path))
    ends = tuple(float(end) for end in np.cumsum([leg.length for leg in legs]))
    return Plan(joined_legs(legs), ends)


def joined_legs(legs: Sequence[Path]) -> Path:
    """Join legs, each beginning where the one before ends, into one path.

    The heading of a via goal is that of the leg that begins there.
    """
    parts = [leg.points[:-1] for leg in legs[:-1]]
    points = np.vstack([*parts, legs[-1].points])
    if all(leg.speed_limits is None for leg in legs):
        return replace(legs[-1], points=points)
    limits = [_limits(leg)[:-1] for leg in legs[:-1]]
    joint = np.concatenate([*limits, _limits(legs[-1])])
    return replace(legs[-1], points=points, speed_limits=joint)


def _limits(leg: Path) -> FloatArray:
    """(n,) the speed limit at each point."""
    none = np.full(len(leg.points), np.inf)
    return none if leg.speed_limits is None else leg.speed_limits


def last_direction(path: Path) -> int:
    """Return +1 or -1 when a path's last step is forward or backward; 0 without a step."""
    if len(path.points) < 2:
        return 0
    (x, y, _), (end_x, end_y, heading) = path.points[-2:]
    along = float(np.cos(heading) * (end_x - x) + np.sin(heading) * (end_y - y))
    return int(np.sign(along))
