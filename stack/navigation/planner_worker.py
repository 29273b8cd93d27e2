"""Planning off the control loop: one worker, results used on time.

A plan asked for at time t is used at t + latency of the robot's clock, whatever the computer
needed for it: the loop waits for a late one. A simulated run is therefore the same on any machine.
A plan that nobody wants any more is stopped within a fraction of a millisecond, so that the next
one need not wait for it; how far it had come by then shows in no result.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from stack.components import CancelToken, Planner, PlanOptions, plan_with_options
from stack.errors import NavigationError
from stack.types import CostGrid, Failure, FailureCode, FloatArray, Path, Pose2D


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
    """What to plan: costs that nobody writes to any more, a start and goals, map frame.

    Attributes:
        partial: where there is no way to a goal, one to the nearest place to it will do.
        direction: +1 or -1 while the robot drives forward or backward, 0 while it stands.
    """

    costs: CostGrid
    start: Pose2D
    goals: tuple[Pose2D, ...]
    partial: bool = False
    direction: int = 0


class PlanFuture:
    """A plan that was asked for."""

    def __init__(
        self,
        request: PlanRequest,
        future: Future[Plan],
        cancel: CancelToken,
        due: float,
        wait: bool,
    ) -> None:
        self.request = request
        self._future, self._cancel, self._due, self._wait = future, cancel, due, wait

    @property
    def over(self) -> bool:
        """Whether nobody works on it any more."""
        return self._future.done()

    def drop(self) -> None:
        """Nobody wants the plan any more: the search for it ends, if it has begun."""
        self._cancel.request()
        self._future.cancel()

    def result(self, time: float) -> Plan | Failure | None:
        """The plan or why there is none; None before its time."""
        if time < self._due - 1e-9 or not (self._wait or self._future.done()):
            return None
        try:
            return self._future.result()
        except CancelledError:
            return Failure(FailureCode.CANCELLED, "nobody wanted the plan any more")
        except NavigationError as error:
            return error.failure
        except Exception as error:  # a planner may be anybody's plugin
            return Failure(FailureCode.EXCEPTION, f"the planner broke: {error!r}")


class PlannerWorker:
    """Takes requests and has them planned, one at a time, in a thread of its own.

    Attributes:
        planner: may be replaced; requests under way keep theirs.
    """

    def __init__(self, planner: Planner) -> None:
        self.planner = planner
        self._worker = ThreadPoolExecutor(max_workers=1, thread_name_prefix="planner")
        self._open: list[PlanFuture] = []

    def ask(self, request: PlanRequest, due: float, *, wait: bool) -> PlanFuture:
        """Have something planned, to be used at the time `due`."""
        cancel = CancelToken()
        future = self._worker.submit(plan_through, self.planner, request, cancel)
        queued = PlanFuture(request, future, cancel, due, wait)
        self._open = [one for one in self._open if not one.over] + [queued]
        return queued

    def close(self) -> None:
        """Let go of the worker; what it was asked for is dropped."""
        for queued in self._open:
            queued.drop()
        self._worker.shutdown(wait=True, cancel_futures=True)


def plan_through(planner: Planner, request: PlanRequest, cancel: CancelToken | None = None) -> Plan:
    """Plan from goal to goal and join the legs.

    Planners of poses drive through each goal with its heading, so that the joins are smooth, and
    count a change of direction there as they do anywhere.

    Raises:
        NavigationError: one of the legs cannot be planned, or CANCELLED.
    """
    cancel = cancel or CancelToken()
    options = PlanOptions(request.partial, request.direction, cancel)
    start, legs = request.start, list[Path]()
    for goal in request.goals:
        cancel.check()
        path = plan_with_options(planner, request.costs, (start, goal), options)
        legs.append(path)
        start, options = path.goal, replace(options, direction=last_way(path))
    ends = tuple(float(end) for end in np.cumsum([leg.length for leg in legs]))
    return Plan(joined(legs), ends)


def joined(legs: Sequence[Path]) -> Path:
    """One path from legs that begin where the one before ends; goals on the way lose headings."""
    points = [leg.points[:-1] for leg in legs[:-1]]
    whole = np.vstack([*points, legs[-1].points])
    if all(leg.speed_limits is None for leg in legs):
        return replace(legs[-1], points=whole)
    limits = [_limits(leg)[:-1] for leg in legs[:-1]]
    joint = np.concatenate([*limits, _limits(legs[-1])])
    return replace(legs[-1], points=whole, speed_limits=joint)


def _limits(leg: Path) -> FloatArray:
    """(n,) the speed limit at each point."""
    none = np.full(len(leg.points), np.inf)
    return none if leg.speed_limits is None else leg.speed_limits


def last_way(path: Path) -> int:
    """+1 or -1 when a path's last step goes with its heading or against it; 0 without a step."""
    if len(path.points) < 2:
        return 0
    (x, y, _), (end_x, end_y, heading) = path.points[-2:]
    along = float(np.cos(heading) * (end_x - x) + np.sin(heading) * (end_y - y))
    return int(np.sign(along))
