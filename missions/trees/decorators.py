"""Decorators that look at conditions, the clock and outcomes. Time is the robot's."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from missions.trees.context import Execution, halt
from missions.trees.node import Decorator, run
from stack.types import Expression, Failure, FailureCode

TOLERANCE = 1e-9
"""Seconds by which a clock made of sums may be short."""


class Subtree(Decorator):
    """`use`: a tree under its own name; adds nothing to what its root does."""

    def advance(self, fresh: bool) -> Status:
        run(self.child)
        if self.child.status is Status.FAILURE:
            return self.execution.pass_on(self, self.child)
        return self.child.status


class When(Decorator):
    """Looked at when the node starts: if it does not hold, the node is skipped.

    `skipped` is the status then: SUCCESS, or FAILURE below a fallback, so that both go on.
    """

    def __init__(
        self, child: Behaviour, execution: Execution, condition: Expression, skipped: Status
    ) -> None:
        super().__init__(f"when {condition.source}", child, execution)
        self.condition, self.skipped = condition, skipped

    def advance(self, fresh: bool) -> Status:
        if fresh and not self.condition():
            halt(self.child)
            why = self.condition.explain()
            if self.skipped is Status.FAILURE:
                return self.execution.fail(self, Failure(FailureCode.CHECK_FAILED, why))
            self.feedback_message = f"skipped: {why}"
            return Status.SUCCESS
        run(self.child)
        if self.child.status is Status.FAILURE:
            return self.execution.pass_on(self, self.child)
        return self.child.status


class While(Decorator):
    """Looked at before every tick: once it does not hold, the child is halted and this fails."""

    def __init__(self, child: Behaviour, execution: Execution, condition: Expression) -> None:
        super().__init__(f"while {condition.source}", child, execution)
        self.condition = condition

    def advance(self, fresh: bool) -> Status:
        if not self.condition():
            halt(self.child)
            why = Failure(FailureCode.CHECK_FAILED, self.condition.explain())
            return self.execution.fail(self, why)
        run(self.child)
        if self.child.status is Status.FAILURE:
            return self.execution.pass_on(self, self.child)
        return self.child.status


class OnFailure(Decorator):
    """`on_failure: continue`: a failure is told and passes for a success."""

    def advance(self, fresh: bool) -> Status:
        run(self.child)
        if self.child.status is Status.FAILURE:
            self.execution.pass_over(self, self.child)
            return Status.SUCCESS
        return self.child.status


class Repeat(Decorator):
    """Runs the child again after each success; one run per tick at most."""

    def __init__(
        self, name: str, child: Behaviour, execution: Execution, times: Callable[[], int | None]
    ) -> None:
        super().__init__(name, child, execution)
        self.times, self.done = times, 0

    def advance(self, fresh: bool) -> Status:
        if fresh:
            self.done = 0
        self.start_child_afresh()
        run(self.child)
        if self.child.status is Status.FAILURE:
            return self.execution.pass_on(self, self.child)
        if self.child.status is Status.RUNNING:
            return Status.RUNNING
        self.done += 1
        times = self.times()
        self.feedback_message = f"{self.done} of {times}" if times else f"{self.done} times"
        return Status.SUCCESS if times is not None and self.done >= times else Status.RUNNING


class Timeout(Decorator):
    """Halts the child once it has run for as long as the limit, and fails TIMED_OUT."""

    def __init__(
        self, name: str, child: Behaviour, execution: Execution, limit: Callable[[], float]
    ) -> None:
        super().__init__(name, child, execution)
        self.limit, self.seconds, self.began = limit, 0.0, 0.0

    def advance(self, fresh: bool) -> Status:
        if fresh:
            self.seconds, self.began = self.limit(), self.execution.time
        run(self.child)
        if self.child.status is Status.FAILURE:
            return self.execution.pass_on(self, self.child)
        if self.child.status is Status.SUCCESS:
            return Status.SUCCESS
        if self.execution.time - self.began >= self.seconds - TOLERANCE:
            halt(self.child)
            why = Failure(FailureCode.TIMED_OUT, f"not done after {self.seconds:g} s")
            return self.execution.fail(self, why, self.child.name)
        return Status.RUNNING

    def postpone(self, seconds: float) -> None:
        self.began += seconds


class Every(Decorator):
    """Runs the child at most once in a period; in between its last result stands.

    The period counts from start to start and outlives halts. A run that was halted left no result:
    the next tick starts the child again.
    """

    def __init__(
        self, name: str, child: Behaviour, execution: Execution, period: Callable[[], float]
    ) -> None:
        super().__init__(name, child, execution)
        self.period, self.began = period, 0.0
        self.result: Status | None = None

    def advance(self, fresh: bool) -> Status:
        now = self.execution.time
        if self.child.status is not Status.RUNNING:
            if self.result is not None and now < self.began + self.period() - TOLERANCE:
                self.feedback_message = f"as {now - self.began:.1f} s ago"
                return self._again(self.result)
            halt(self.child)
            self.began, self.result = now, None
        status = run(self.child)
        self.result = None if status is Status.RUNNING else status
        return self._again(status)

    def _again(self, status: Status) -> Status:
        if status is Status.FAILURE:
            return self.execution.pass_on(self, self.child)
        return status


class ForEach(Decorator):
    """The child once per item, with the item in the loop variable; an empty list succeeds at once.

    Items that are done within a tick follow each other within the tick, as in a sequence.
    """

    def __init__(self, name: str, child: Behaviour, execution: Execution, loop: Loop) -> None:
        super().__init__(name, child, execution)
        self.loop, self.items, self.index = loop, list[Any](), 0

    def advance(self, fresh: bool) -> Status:
        if fresh:
            self.items, self.index = list(self.loop.items()), 0
        while self.index < len(self.items):
            if self.child.status is not Status.RUNNING:
                self._take()
            run(self.child)
            if self.child.status is Status.RUNNING:
                return Status.RUNNING
            failed = self.child.status is Status.FAILURE
            self._ended(self.execution.trail(self.child).failure if failed else None)
            if failed and not self.loop.skip_failures:
                return self.execution.pass_on(self, self.child, self._item())
            if failed:
                self._pass_over()
            self.index += 1
        return Status.SUCCESS

    def _ended(self, failure: Failure | None) -> None:
        """An item is done, or failed for this reason."""

    def _pass_over(self) -> None:
        self.execution.pass_over(self, self.child, self._item())

    def _take(self) -> None:
        halt(self.child)
        self.loop.write(self.items[self.index])
        self.feedback_message = f"{self._item()}, {self.index + 1} of {len(self.items)}"

    def _item(self) -> str:
        return f"{self.loop.variable} = {self.execution.describe(self.items[self.index])}"


class Loop:
    """What a ForEach runs over: where items come from and where each one goes."""

    def __init__(
        self, variable: str, items: Callable[[], list[Any]], write: Callable[[Any], None],
        skip_failures: bool,
    ) -> None:  # fmt: skip
        self.variable, self.items, self.write = variable, items, write
        self.skip_failures = skip_failures
