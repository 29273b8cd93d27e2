"""`finally` and `switch`: nodes with several children of which one runs at a time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from py_trees import composites
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from missions.trees.context import WORDS, Execution, halt
from missions.trees.node import Decorator, InnerNode, run
from stack.types import Expression, Failure, FailureCode


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
            if first.skipped and first.status is Status.SUCCESS:
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


class Case(Decorator):
    """One case of a `switch`; its outcome is that of its node."""

    def advance(self, fresh: bool) -> Status:
        run(self.child)
        return self.outcome_of_child()


class Switch(InnerNode, composites.Composite):
    """Runs the case of a text; chooses at the start, and keeps to it until the case ends.

    Args:
        cases: text -> node.
        default: node for all other texts; without one the node fails.
    """

    def __init__(
        self, name: str, execution: Execution, value: Expression, cases: Mapping[str, Behaviour],
        default: Behaviour | None,
    ) -> None:  # fmt: skip
        super().__init__(name, [*cases.values(), *([default] if default else [])])
        self.execution, self.value, self.cases, self.default = execution, value, cases, default

    def advance(self, fresh: bool) -> Status:
        if fresh:
            self.reset()
            text = self.value()
            self.current_child = self.cases.get(text, self.default)
            self.feedback_message = self.value.explain()
            if self.current_child is None:
                sentence = f"no case for {text!r}: {self.value.explain()}"
                return self.execution.fail(self, Failure(FailureCode.CHECK_FAILED, sentence))
        child: Any = self.current_child
        run(child)
        if child.status is Status.FAILURE:
            return self.execution.propagate_failure(self, child)
        skipped = child.skipped and child.status is Status.SUCCESS
        return self.skip() if skipped else child.status
