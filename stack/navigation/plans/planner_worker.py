"""Planning outside the control loop: one worker thread, results at a fixed latency.

A plan requested at time t is used at t + latency on the robot's clock, however long it took to
compute: the loop waits for a late plan. A simulated run is therefore the same on every machine.
A cancelled search stops within a fraction of a millisecond, so that the next one starts without
delay; its progress does not affect any result.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import CancelledError, Future
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from stack.components import CancelToken, Planner, PlanOptions
from stack.errors import NavigationError, WorkerError, exception_sentence, traceback_text
from stack.patience import Patience
from stack.types import CostGrid, Failure, FailureCode, FloatArray, Path, Pose2D
from stack.worker_thread import WorkerThread


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


class PlanFuture:
    """Handle of a requested plan."""

    def __init__(  # noqa: PLR0913 - called once
        self,
        request: PlanRequest,
        worker: WorkerThread,
        future: Future[Plan],
        cancel: CancelToken,
        due: float,
        wait: bool,
        log: Callable[[str], None],
    ) -> None:
        self.request, self._log, self._worker = request, log, worker
        self._future, self._cancel, self._due, self._wait = future, cancel, due, wait
        self._dropped = False

    @property
    def over(self) -> bool:
        """Whether the search has ended."""
        return self._future.done()

    def is_late(self, time: float) -> bool:
        """Whether `result` would wait at this time, robot's clock."""
        waits = self._wait and not self._dropped and not self._future.done()
        return waits and time >= self._due - 1e-9

    def drop(self) -> None:
        """Cancel the plan; a search that has started stops."""
        self._dropped = True
        self._cancel.request()
        self._future.cancel()

    def join(self, longest: float) -> bool:
        """Wait at most `longest` wall seconds; return whether `result` returns at once."""
        return self._worker.await_job(self._future, longest)

    def result(self, time: float) -> Plan | Failure | None:
        """Return the plan or the failure; None before it is due."""
        if time < self._due - 1e-9:
            return None
        try:
            if not (self._wait or self._future.done()):
                if Patience.is_over(self._due, time):
                    raise self._worker.silence
                return None
            return self._worker.result(self._future)
        except CancelledError:
            return Failure(FailureCode.CANCELLED, "the plan was cancelled")
        except NavigationError as error:
            return error.failure
        except WorkerError as error:
            self.drop()
            return Failure(FailureCode.EXCEPTION, str(error))
        except Exception as error:  # a planner may be a plugin
            what = "the planner raised an exception"
            self._log(traceback_text(what, error))
            return Failure(FailureCode.EXCEPTION, f"{what}: {exception_sentence(error)}")


class PlannerWorker:
    """Plans requests one at a time in its own thread.

    Attributes:
        planner: may be replaced; open requests keep their planner.
    """

    def __init__(
        self, planner: Planner, log: Callable[[str], None] = lambda _: None, *,
        is_real_time: bool = False,
    ) -> None:  # fmt: skip
        self.planner, self._log, self._waits = planner, log, not is_real_time
        self._worker = WorkerThread("the planner")
        self._open: list[PlanFuture] = []

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
        future = self._worker.submit(partial(plan_through, self.planner, request, cancel))
        future.add_done_callback(lambda _: over())
        queued = PlanFuture(request, self._worker, future, cancel, due, self._waits, self._log)
        self._open = [item for item in self._open if not item.over] + [queued]
        return queued

    def use(self, planner: Planner) -> None:
        """Plan with another planner from now on."""
        self.planner = planner

    def await_plans(self, time: float, longest: float) -> bool:
        """Wait at most `longest` wall seconds for plans that are due.

        Args:
            time: robot's clock, seconds.
            longest: wall seconds.

        Returns:
            Whether there is no late plan: `PlanFuture.result` returns at once.
        """
        late = [queued for queued in self._open if queued.is_late(time)]
        if late:
            late[0].join(longest)
        return all(queued.join(0.0) for queued in late)

    def close(self) -> None:
        """Cancel all requests and stop the worker."""
        for queued in self._open:
            queued.drop()
        self._worker.close()


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
