"""Decorators for conditions, time limits, repetition and loops; they use the robot's clock."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from collections.abc import Sequence as Items
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from behaviours.timer import Timer
from missions.trees.context import Execution, halt
from missions.trees.node import Decorator, run
from stack.types import Expression, Failure, FailureCode

Write = Callable[[Any], None]


class Subtree(Decorator):
    """`use`: a named subtree; its outcome is that of its root.

    Args:
        unbound: writers of outputs without a target, which are unset at the start of a run.
        optional: writers of targets without an initial value, which are unset after a failure.
    """

    def __init__(
        self, name: str, child: Behaviour, execution: Execution,
        unbound: Items[Write] = (), optional: Items[Write] = (),
    ) -> None:  # fmt: skip
        super().__init__(name, child, execution)
        self.unbound, self.optional = unbound, optional

    def advance(self, fresh: bool) -> Status:
        if fresh:
            for write in self.unbound:
                write(None)
        run(self.child)
        status = self.outcome_of_child()
        if status is Status.FAILURE:
            for write in self.optional:
                write(None)
        return status


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
        if status is Status.SUCCESS and not self.outcome_of_child_is_skip():
            why = Failure(FailureCode.CHECK_FAILED, f"{self.child.name} succeeded, inverted")
            return self.execution.fail(self, why, self.child.name)
        return self.outcome_of_child()


class Repeat(Decorator):
    """Runs the child again after each success; at most one run per tick.

    With `until` it ends after the run after which the condition is true. A skipped run counts as a
    run. If all runs were skipped, the node is skipped.
    """

    def __init__(
        self, name: str, child: Behaviour, execution: Execution, times: Callable[[], int | None],
        until: Expression | None = None,
    ) -> None:  # fmt: skip
        super().__init__(name, child, execution)
        self.times, self.until, self.done, self.left_out = times, until, 0, 0

    def advance(self, fresh: bool) -> Status:
        if fresh:
            self.done = self.left_out = 0
        self.reset_finished_child()
        child: Any = self.child
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
        self.feedback_message = f"{self.done} of {times}" if times else f"{self.done} times"
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
            why = Failure(FailureCode.TIMED_OUT, f"not finished after {self.seconds:g} s")
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


class ForEach(Decorator):
    """Runs the child once per item, with the item in the loop variable.

    Succeeds at once if the list is empty; is skipped if all items are. After an item ends, the next
    one starts in the same tick, as in a sequence, unless the loops of the tree have started
    ITEMS_PER_TICK items in this tick; a loop always starts at least one.
    """

    def __init__(self, name: str, child: Behaviour, execution: Execution, loop: Loop) -> None:
        super().__init__(name, child, execution)
        self.loop, self.items, self.index, self.left_out = loop, list[Any](), 0, 0

    def advance(self, fresh: bool) -> Status:
        if fresh:
            self.items, self.index, self.left_out = list(self.loop.items()), 0, 0
        child: Any = self.child
        first = self.index
        while self.index < len(self.items):
            if child.status is not Status.RUNNING:
                if self.execution.items_left <= 0 and self.index > first:
                    return Status.RUNNING
                self.execution.items_left -= 1
                self._start_item()
            run(child)
            if child.status is Status.RUNNING:
                return Status.RUNNING
            failed = child.status is Status.FAILURE
            self.left_out += child.skipped and not failed
            self._item_ended(self.execution.trace(self.child).failure if failed else None)
            if failed and not self.loop.skip_failures:
                return self.execution.propagate_failure(self, self.child, self._item())
            if failed:
                self._ignore_failure()
            self.index += 1
        if self.items and self.left_out == len(self.items):
            return self.skip()
        return Status.SUCCESS

    def _item_ended(self, failure: Failure | None) -> None:
        """Called when an item has ended, with its failure if it failed."""

    def _ignore_failure(self) -> None:
        self.execution.ignore_failure(self, self.child, self._item())

    def _start_item(self) -> None:
        halt(self.child)
        self.loop.write(self.items[self.index])
        self.feedback_message = f"{self._item()}, {self.index + 1} of {len(self.items)}"

    def _item(self) -> str:
        return f"{self.loop.variable} = {self.execution.describe(self.items[self.index])}"


class Loop:
    """The loop of a ForEach: source of the items and writer of the loop variable."""

    def __init__(
        self, variable: str, items: Callable[[], list[Any]], write: Callable[[Any], None],
        skip_failures: bool,
    ) -> None:  # fmt: skip
        self.variable, self.items, self.write = variable, items, write
        self.skip_failures = skip_failures
