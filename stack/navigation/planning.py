"""Planning off the control loop: one worker, results used on time.

A plan asked for at time t is used at t + latency of the robot's clock, whatever the computer
needed for it: the loop waits for a late one. A simulated run is therefore the same on any machine.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from stack.components import Planner
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
    """What to plan: costs that nobody writes to any more, a start and goals, map frame."""

    costs: CostGrid
    start: Pose2D
    goals: tuple[Pose2D, ...]


class Ticket:
    """A plan that was asked for."""

    def __init__(self, request: PlanRequest, future: Future[Plan], due: float, wait: bool) -> None:
        self.request = request
        self._future, self._due, self._wait = future, due, wait

    def result(self, time: float) -> Plan | Failure | None:
        """The plan or why there is none; None before its time."""
        if time < self._due - 1e-9 or not (self._wait or self._future.done()):
            return None
        try:
            return self._future.result()
        except NavigationError as error:
            return error.failure
        except Exception as error:  # a planner may be anybody's plugin
            return Failure(FailureCode.EXCEPTION, f"the planner broke: {error!r}")


class PlanningDesk:
    """Takes requests and has them planned, one at a time, in a thread of its own.

    Attributes:
        planner: may be replaced; requests under way keep theirs.
    """

    def __init__(self, planner: Planner) -> None:
        self.planner = planner
        self._worker = ThreadPoolExecutor(max_workers=1, thread_name_prefix="planner")

    def ask(self, request: PlanRequest, due: float, *, wait: bool) -> Ticket:
        """Have something planned, to be used at the time `due`."""
        return Ticket(request, self._worker.submit(plan_through, self.planner, request), due, wait)

    def close(self) -> None:
        """Let go of the worker; requests not begun are dropped."""
        self._worker.shutdown(wait=True, cancel_futures=True)


def plan_through(planner: Planner, request: PlanRequest) -> Plan:
    """Plan from goal to goal and join the legs.

    Raises:
        NavigationError: one of the legs cannot be planned.
    """
    start, legs = request.start, []
    for goal in request.goals:
        path = planner.plan(request.costs, start, goal)
        legs.append(path)
        start = path.goal
    ends = tuple(float(end) for end in np.cumsum([leg.length for leg in legs]))
    return Plan(joined(legs), ends)


def joined(legs: Sequence[Path]) -> Path:
    """One path from legs that begin where the one before ends; goals on the way lose headings."""
    points = [leg.points[:-1] for leg in legs[:-1]]
    whole = np.vstack([*points, legs[-1].points])
    if all(leg.speed_limits is None for leg in legs):
        return Path(whole)
    limits = [_limits(leg)[:-1] for leg in legs[:-1]]
    return Path(whole, np.concatenate([*limits, _limits(legs[-1])]))


def _limits(leg: Path) -> FloatArray:
    """(n,) the speed limit at each point."""
    none = np.full(len(leg.points), np.inf)
    return none if leg.speed_limits is None else leg.speed_limits
