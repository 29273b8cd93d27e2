"""What stands between a leaf and the tree: exceptions become failures, starts and ends pair up."""

from __future__ import annotations

from collections.abc import Callable
from traceback import format_exc
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from missions.language.expressions.scope import NotSet
from missions.trees.context import Execution, Record
from stack.types import Failure, FailureCode

# Module names are looked up faster than attributes of the enumeration; leaves are ticked often.
_RUNNING, _SUCCESS, _FAILURE, _INVALID = (
    Status.RUNNING, Status.SUCCESS, Status.FAILURE, Status.INVALID,
)  # fmt: skip


class LeafNode:
    """Wraps a leaf's initialise, update, terminate and stop, and adds `execute_tick`.

    An exception in one of them becomes FAILURE of that leaf with code EXCEPTION; the traceback goes
    to the log and the tree stays whole. The leaf's own `terminate` is called exactly once after
    each `initialise`: py_trees alone calls it again whenever a finished parent is reset.
    `execute_tick` is the leaf's tick as a direct call; a method that the leaf does not override is
    not called. The tree that the leaf belongs to sets `record`.
    """

    record: Record

    def __init__(self, leaf: Behaviour, execution: Execution) -> None:
        self.leaf, self.execution = leaf, execution
        self.moves = bool(getattr(leaf, "uses_wheels", False))
        self.active, self.broken = False, False
        self.tells_why = hasattr(leaf, "failure")
        self._initialise = _own(leaf, "initialise")
        self._update = leaf.update
        self._terminate = _own(leaf, "terminate")
        self._just_updates = not (
            self.moves or self.tells_why or self._initialise or self._terminate
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
            # `update` written out: this is the most frequent call of a mission.
            try:
                status = self._update()
            except (Exception, SystemExit) as error:
                status = self._raised(error)
            if status is not _RUNNING and not (status is _SUCCESS and self._just_updates):
                status = self._answered(status)
        if status is not before:
            leaf.status = status
        record = self.record
        if record.status is not status:
            execution.changed(record, status)
        if execution.visited is not None:
            execution.visited.append((leaf, status))
        return status

    def initialise(self) -> None:
        """Start the leaf; a leaf that moves the robot has the wheels to itself first."""
        leaf, execution = self.leaf, self.execution
        if self.moves:
            execution.free_the_wheels()
        self.active, self.broken = True, False
        if execution.starts is not None:
            execution.starts(leaf)
        leaf.feedback_message = ""
        if self.tells_why:
            leaf.failure = None  # type: ignore[attr-defined] # as `tells_why` says
        if self._initialise is not None:
            self._safely(self._initialise)

    def update(self) -> Status:
        """Tick the leaf; it has ended properly before the tree knows its outcome."""
        if self.broken:
            return self._ended(_FAILURE)
        try:
            status = self._update()
        except (Exception, SystemExit) as error:
            status = self._raised(error)
        return status if status is _RUNNING else self._answered(status)

    def terminate(self, new_status: Status) -> None:
        """Halt the leaf if it is under way; ends of its own were dealt with in `update`."""
        if self.active:
            self.active = False
            if self._terminate is not None:
                self._safely(self._terminate, new_status)
        if new_status is _INVALID and self.record.status is not _INVALID:
            self.execution.changed(self.record, new_status)

    def stop(self, new_status: Status) -> None:
        """As py_trees' Behaviour.stop."""
        self.terminate(new_status)
        self.leaf.status = new_status

    def _raised(self, error: BaseException) -> Status:
        self._report(error)
        return _FAILURE

    def _answered(self, status: Status) -> Status:
        """The leaf does not run on: what its answer is to the tree."""
        if status is _SUCCESS and self._terminate is None:
            self.active = False
            return status
        if status is not _SUCCESS and status is not _FAILURE:
            said = (
                f"update returned a {type(status).__name__}, wanted is RUNNING, SUCCESS or FAILURE"
            )
            self._fail(FailureCode.EXCEPTION, said)
            self._tell(said)
            status = _FAILURE
        return self._ended(status)

    def _ended(self, status: Status) -> Status:
        self.active = False
        if self._terminate is not None and not self._safely(self._terminate, status):
            status = _FAILURE
        if status is _FAILURE and not self.broken:
            failure = getattr(self.leaf, "failure", None)
            said = self.leaf.feedback_message or "failed"
            self.execution.fail(self.leaf, failure or Failure(FailureCode.FAILED, said))
        return status

    def _safely(self, call: Callable[..., Any], *arguments: Status) -> bool:
        try:
            call(*arguments)
        except (Exception, SystemExit) as error:
            self._report(error)
            return False
        return True

    def _report(self, error: BaseException) -> None:
        """Make an exception this leaf's failure; a key that is not set needs no traceback."""
        if isinstance(error, NotSet):
            self._fail(FailureCode.FAILED, str(error))
            return
        said = f"{type(error).__name__}: {error}"
        self.execution.log(f"{self.leaf.name}\n{format_exc()}")
        self._fail(FailureCode.EXCEPTION, said)
        self._tell(said)

    def _fail(self, code: FailureCode, sentence: str) -> None:
        self.broken = True
        failure = Failure(code, sentence)
        if self.tells_why:
            self.leaf.failure = failure  # type: ignore[attr-defined] # as `tells_why` says
        self.execution.fail(self.leaf, failure)

    def _tell(self, said: str) -> None:
        self.execution.emit(
            level="error", kind="exception", text=f"{self.leaf.name}: {said}",
            fields={"node": self.execution.record(self.leaf).id, "name": self.leaf.name},
        )  # fmt: skip


def _own(leaf: Behaviour, method: str) -> Callable[..., Any] | None:
    """A method of the leaf, unless it is the empty one of py_trees' Behaviour."""
    inherited = getattr(type(leaf), method) is getattr(Behaviour, method)
    return None if inherited else getattr(leaf, method)
