"""Nodes of modifiers: conditions, time limits, repetition; they use the robot's clock."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from py_trees import composites
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from behaviours.timer import Timer
from missions.trees.context import WORDS, Execution, halt
from missions.trees.node import Decorator, InnerNode, run
from stack.types import Expression, Failure, FailureCode


class When(Decorator):
    """Evaluates a condition when the node starts; if it is false, the node is skipped."""

    def __init__(self, child: Behaviour, execution: Execution, condition: Expression) -> None:
        super().__init__(f"when {condition.source}", child, execution)
        self.condition = condition

    def advance(self, fresh: bool) -> Status:
        if fresh and not self.condition():
            halt(self.child)
            return self.skip(f"skipped: {self.condition.explain()}")
        run(self.child)
        return self.outcome_of_child()


class While(Decorator):
    """Evaluates a condition before every tick; if it is false, halts the child and fails."""

    def __init__(self, child: Behaviour, execution: Execution, condition: Expression) -> None:
        super().__init__(f"while {condition.source}", child, execution)
        self.condition = condition

    def advance(self, fresh: bool) -> Status:
        if not self.condition():
            self.reset_finished_child()
            why = Failure(FailureCode.CHECK_FAILED, self.condition.explain())
            return self.execution.fail(self, why)
        run(self.child)
        return self.outcome_of_child()


class OnFailure(Decorator):
    """`on_failure: continue`: reports a failure and returns success."""

    def advance(self, fresh: bool) -> Status:
        run(self.child)
        if self.child.status is Status.FAILURE:
            self.execution.ignore_failure(self, self.child)
            return Status.SUCCESS
        return self.outcome_of_child()


class Invert(Decorator):
    """Turns a success into a failure with CHECK_FAILED, and a failure into a success."""

    def advance(self, fresh: bool) -> Status:
        status = run(self.child)
        if status is Status.FAILURE:
            self.feedback_message = self.execution.trace(self.child).failure.sentence
            return Status.SUCCESS
        if status is Status.SUCCESS and not self.child.was_skipped:
            why = Failure(FailureCode.CHECK_FAILED, f"{self.child.name} succeeded, inverted")
            return self.execution.fail(self, why, self.child.name)
        return self.outcome_of_child()


class Repeat(Decorator):
    """Runs the child again after each success; at most one run per tick.

    With `until` it ends after the run after which the condition is true. A skipped run counts as a
    run. If all runs were skipped, the node is skipped.
    """

    def __init__(  # noqa: PLR0913 - one call from one place
        self, name: str, child: Behaviour, execution: Execution, times: Callable[[], int | None],
        until: Expression | None = None, *, counts_runs: bool = True,
    ) -> None:  # fmt: skip
        super().__init__(name, child, execution)
        self.times, self.until, self.counts_runs = times, until, counts_runs
        self.done = self.left_out = 0

    def advance(self, fresh: bool) -> Status:
        if fresh:
            self.done = self.left_out = 0
        self.reset_finished_child()
        child = self.child
        run(child)
        if child.status is Status.FAILURE:
            return self.execution.propagate_failure(self, child)
        if child.status is Status.RUNNING:
            return Status.RUNNING
        self.done += 1
        self.left_out += child.skipped
        if not self._is_over():
            return Status.RUNNING
        return self.skip() if self.left_out == self.done else Status.SUCCESS

    def _is_over(self) -> bool:
        times = self.times()
        self.feedback_message = f"{self.done} of {times}" if times else ""
        if not times and self.counts_runs:  # results that `every` only repeats are no runs
            self.feedback_message = f"{self.done} times"
        if self.until is not None:
            return bool(self.until())
        return times is not None and self.done >= times


class Timeout(Decorator):
    """Halts the child when it has run for the time limit, and fails with TIMED_OUT."""

    def __init__(
        self, name: str, child: Behaviour, execution: Execution, limit: Callable[[], float]
    ) -> None:
        super().__init__(name, child, execution)
        self.limit, self.seconds, self.timer = limit, 0.0, Timer(execution)

    def advance(self, fresh: bool) -> Status:
        if fresh:
            self.seconds = self.limit()
            self.timer.restart()
        run(self.child)
        if self.child.status is not Status.RUNNING:
            return self.outcome_of_child()
        if self.timer.is_over(self.seconds):
            held = self.execution.robot.base.held(self.execution.time - self.timer.elapsed)
            sentence = f"not finished after {self.seconds:g} s" + (f"; {held}" if held else "")
            why = Failure(FailureCode.TIMED_OUT, sentence)
            return self.execution.fail(self, why, self.child.name)
        return Status.RUNNING

    def timers(self) -> Iterable[Timer]:
        return (self.timer,)


class Every(Decorator):
    """Runs the child at most once per period; in between returns its last result.

    The period counts from start to start, also across halts. A halted run has no result: the next
    tick starts the child again.
    """

    def __init__(
        self, name: str, child: Behaviour, execution: Execution, period: Callable[[], float]
    ) -> None:
        super().__init__(name, child, execution)
        self.period, self.timer = period, Timer(execution)
        self.result: Status | None = None

    def advance(self, fresh: bool) -> Status:
        if self.child.status is not Status.RUNNING:
            if self.result is not None and not self.timer.is_over(self.period()):
                self.feedback_message = f"result of {self.timer.elapsed:.1f} s ago"
                return self._outcome(self.result)
            halt(self.child)
            self.timer.restart()
            self.result = None
        status = run(self.child)
        self.result = None if status is Status.RUNNING else status
        return self._outcome(status)

    def timers(self) -> Iterable[Timer]:
        return (self.timer,)

    def _outcome(self, status: Status) -> Status:
        return status if status is Status.RUNNING else self.outcome_of_child()


class Finally(InnerNode, composites.Composite):
    """Runs the second child however the first one ends; the outcome is that of the first.

    After a success or failure the second child runs to its end. If it fails after a success, the
    node fails with it; after a failure the first failure stays. When the node is halted, the first
    child is halted and the second one gets one tick; if it still runs then, it is halted too and
    the log says so. It does not run if the first child was skipped or has not started.
    """

    def __init__(self, node: Behaviour, last: Behaviour, execution: Execution) -> None:
        super().__init__("finally", [node, last])
        self.execution = execution
        self.first, self.last = node, last
        self.has_begun = self.has_ended = False

    def advance(self, fresh: bool) -> Status:
        first: Any = self.first
        if fresh:
            self.reset()
            self.has_begun, self.has_ended = True, False
        if not self.has_ended:
            self.current_child = first
            run(first)
            if first.status is Status.RUNNING:
                return Status.RUNNING
            if first.was_skipped:
                self.has_begun = False
                return self.skip()
            self.has_ended = True
            self.feedback_message = f"after {WORDS[first.status]}"
        self.current_child = self.last
        if run(self.last) is Status.RUNNING:
            return Status.RUNNING
        self.has_begun = False
        return self._outcome()

    def stop(self, new_status: Status = Status.INVALID) -> None:
        """Set the status; when halted, run the second child for one tick."""
        if new_status is not Status.FAILURE and new_status is not Status.SUCCESS:
            self._halt_children()
        elif self.has_begun:  # a value of the first child is missing
            self._halt_children()
        self.terminate(new_status)
        self.status = new_status

    def _halt_children(self) -> None:
        halt(self.first)
        if self.has_begun and not self.has_ended:
            self.has_begun, ticked = False, self.execution.ticked[0]
            if run(self.last) is Status.RUNNING:
                self._emit("is halted after one tick, because its node was halted")
            elif self.last.status is Status.FAILURE:
                self._emit(self.execution.trace(self.last).failure.sentence)
            self.execution.ticked[0] = ticked
        self.has_begun = False
        halt(self.last)

    def _outcome(self) -> Status:
        if self.first.status is Status.FAILURE:
            if self.last.status is Status.FAILURE:
                self._emit(self.execution.trace(self.last).failure.sentence)
            return self.execution.propagate_failure(self, self.first)
        if self.last.status is Status.FAILURE:
            return self.execution.propagate_failure(self, self.last)
        return Status.SUCCESS

    def _emit(self, what: str) -> None:
        record = self.execution.record(self)
        self.execution.emit(
            level="warning", kind="finally", text=f"finally: {self.last.name}: {what}",
            fields={"node": record.id, "name": self.last.name},
        )  # fmt: skip
