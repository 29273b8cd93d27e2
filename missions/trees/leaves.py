"""Wrapper of leaves: converts exceptions to failures, pairs each start with one end."""

from __future__ import annotations

from collections.abc import Callable
from traceback import format_exc
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from missions.language.expressions.scope import NotSet
from missions.trees.context import Execution, Record
from stack.types import Failure, FailureCode

# Module globals are faster than attributes of the enum; leaves are ticked often.
_RUNNING, _SUCCESS, _FAILURE, _INVALID = (
    Status.RUNNING, Status.SUCCESS, Status.FAILURE, Status.INVALID,
)  # fmt: skip


class LeafNode:
    """Wraps a leaf's initialise, update, terminate and stop, and adds `execute_tick`.

    An exception in one of them becomes FAILURE of the leaf with code EXCEPTION; the traceback goes
    to the log and the rest of the tree is not affected. The leaf's own `terminate` is called
    exactly once after each `initialise`; py_trees alone would call it again when a finished parent
    is reset. `execute_tick` ticks the leaf by a direct call; methods that the leaf does not
    override are not called. The tree of the leaf sets `record`.
    """

    record: Record

    def __init__(self, leaf: Behaviour, execution: Execution) -> None:
        self.leaf, self.execution = leaf, execution
        self.moves = bool(getattr(leaf, "uses_wheels", False))
        self.active, self.broken = False, False
        self.has_failure = hasattr(leaf, "failure")
        self._initialise = _own(leaf, "initialise")
        self._update = leaf.update
        self._terminate = _own(leaf, "terminate")
        self._just_updates = not (
            self.moves or self.has_failure or self._initialise or self._terminate
        )
        for name in ("initialise", "update", "terminate", "stop", "execute_tick"):
            setattr(leaf, name, getattr(self, name))

    def execute_tick(self) -> Status:
        """Tick the leaf as py_trees' Behaviour.tick does, without its generator."""
        leaf, execution = self.leaf, self.execution
        before = leaf.status
        if before is not _RUNNING:
            if self._just_updates and execution.starts is None:
                self.broken = False
                if leaf.feedback_message:
                    leaf.feedback_message = ""
            else:
                self.initialise()
        if self.broken:
            status = self._ended(_FAILURE)
        else:
            # Inlined `update`: this is the most frequent call of a mission.
            try:
                status = self._update()
            except (Exception, SystemExit) as error:
                status = self._handle_exception(error)
            if status is not _RUNNING and not (status is _SUCCESS and self._just_updates):
                status = self._handle_result(status)
        if status is not before:
            leaf.status = status
        record = self.record
        if record.status is not status:
            execution.change_status(record, status)
        if execution.visited is not None:
            execution.visited.append((leaf, status))
        return status

    def initialise(self) -> None:
        """Start the leaf; before a leaf that moves the robot, halt pre-emptible nodes."""
        leaf, execution = self.leaf, self.execution
        if self.moves:
            execution.halt_preemptible()
        self.active, self.broken = True, False
        if execution.starts is not None:
            execution.starts(leaf)
        leaf.feedback_message = ""
        if self.has_failure:
            leaf.failure = None  # type: ignore[attr-defined] # as `has_failure` says
        if self._initialise is not None:
            self._safely(self._initialise)

    def update(self) -> Status:
        """Tick the leaf; its end is handled before the tree receives its outcome."""
        if self.broken:
            return self._ended(_FAILURE)
        try:
            status = self._update()
        except (Exception, SystemExit) as error:
            status = self._handle_exception(error)
        return status if status is _RUNNING else self._handle_result(status)

    def terminate(self, new_status: Status) -> None:
        """Halt the leaf if it is running; `update` has handled its other ends."""
        if self.active:
            self.active = False
            if self._terminate is not None:
                self._safely(self._terminate, new_status)
        if new_status is _INVALID and self.record.status is not _INVALID:
            self.execution.change_status(self.record, new_status)

    def stop(self, new_status: Status) -> None:
        """Stop the leaf, as py_trees' Behaviour.stop does."""
        self.terminate(new_status)
        self.leaf.status = new_status

    def _handle_exception(self, error: BaseException) -> Status:
        self._report(error)
        return _FAILURE

    def _handle_result(self, status: Status) -> Status:
        """Handle a result other than RUNNING; return the outcome for the tree."""
        if status is _SUCCESS and self._terminate is None:
            self.active = False
            return status
        if status is not _SUCCESS and status is not _FAILURE:
            sentence = (
                f"update returned a {type(status).__name__}, expected RUNNING, SUCCESS or FAILURE"
            )
            self._fail(FailureCode.EXCEPTION, sentence)
            self._emit(sentence)
            status = _FAILURE
        return self._ended(status)

    def _ended(self, status: Status) -> Status:
        self.active = False
        if self._terminate is not None and not self._safely(self._terminate, status):
            status = _FAILURE
        if status is _FAILURE and not self.broken:
            failure = getattr(self.leaf, "failure", None)
            sentence = self.leaf.feedback_message or "failed"
            self.execution.fail(self.leaf, failure or Failure(FailureCode.FAILED, sentence))
        return status

    def _safely(self, call: Callable[..., Any], *arguments: Status) -> bool:
        try:
            call(*arguments)
        except (Exception, SystemExit) as error:
            self._report(error)
            return False
        return True

    def _report(self, error: BaseException) -> None:
        """Turn an exception into the leaf's failure; an unset key needs no traceback."""
        if isinstance(error, NotSet):
            self._fail(FailureCode.FAILED, str(error))
            return
        sentence = f"{type(error).__name__}: {error}"
        self.execution.log(f"{self.leaf.name}\n{format_exc()}")
        self._fail(FailureCode.EXCEPTION, sentence)
        self._emit(sentence)

    def _fail(self, code: FailureCode, sentence: str) -> None:
        self.broken = True
        failure = Failure(code, sentence)
        if self.has_failure:
            self.leaf.failure = failure  # type: ignore[attr-defined] # as `has_failure` says
        self.execution.fail(self.leaf, failure)

    def _emit(self, sentence: str) -> None:
        self.execution.emit(
            level="error", kind="exception", text=f"{self.leaf.name}: {sentence}",
            fields={"node": self.execution.record(self.leaf).id, "name": self.leaf.name},
        )  # fmt: skip


def _own(leaf: Behaviour, method: str) -> Callable[..., Any] | None:
    """Return a method of the leaf; None if it is the empty one of py_trees' Behaviour."""
    inherited = getattr(type(leaf), method) is getattr(Behaviour, method)
    return None if inherited else getattr(leaf, method)
