"""Leaf nodes: wrap a behaviour, convert exceptions to failures, pair each start with one end."""

from __future__ import annotations

from collections.abc import Callable
from traceback import format_exc
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from behaviours.base import RobotBehaviour
from missions.trees.context import Execution
from missions.trees.node import Node
from missions.trees.outputs import Outputs
from stack.errors import EvaluationError, NavigationError, exception_sentence
from stack.types import STANDSTILL, Failure, FailureCode

STOP_TIME = 0.3
"""Seconds of the zero velocity that stops a robot after an exception."""

# Module globals are faster than attributes of the enum; leaves are ticked often.
_RUNNING, _SUCCESS, _FAILURE, _INVALID = (
    Status.RUNNING, Status.SUCCESS, Status.FAILURE, Status.INVALID,
)  # fmt: skip


class LeafNode(Node):
    """A leaf of the tree, with the behaviour that it runs.

    An exception in a method of the behaviour becomes FAILURE of the leaf with code EXCEPTION; the
    traceback goes to the log and the rest of the tree is not affected. The behaviour's `terminate`
    is called exactly once after each `initialise`; py_trees alone would call it again when a
    finished parent is reset. Methods that the behaviour does not override are not called.

    Attributes:
        leaf: the behaviour; it has the same status and the same feedback message.
        active: the behaviour is between `initialise` and `terminate`.
        broken: a method raised an exception, so that the leaf fails.
    """

    def __init__(
        self, leaf: Behaviour, execution: Execution, outputs: Outputs | None = None
    ) -> None:
        message = leaf.feedback_message
        self.leaf, self.execution = leaf, execution
        super().__init__(leaf.name)
        self.feedback_message, self.blackboards = message, leaf.blackboards
        self.robot_leaf = leaf if isinstance(leaf, RobotBehaviour) else None
        self.active = self.broken = self._paused = False
        own = type(leaf)
        self._initialise = leaf.initialise if own.initialise is not Behaviour.initialise else None
        self._update = leaf.update if outputs is None else self._update_with_outputs
        self._terminate = leaf.terminate if own.terminate is not Behaviour.terminate else None
        self._outputs = outputs
        self._just_updates = not (self.robot_leaf or self._initialise or self._terminate)

    @property
    def feedback_message(self) -> str:
        """The message of the behaviour."""
        return self.leaf.feedback_message

    @feedback_message.setter
    def feedback_message(self, message: str) -> None:
        self.leaf.feedback_message = message

    def setup(self, **resources: Any) -> None:
        """Set the behaviour up."""
        self.leaf.setup(**resources)

    def shutdown(self) -> None:
        """Shut the behaviour down, as py_trees' tools do."""
        self.leaf.shutdown()

    def execute_tick(self) -> Status:  # noqa: C901 - calls would slow every tick
        """Tick the leaf as py_trees' Behaviour.tick does, without its generator."""
        record = self.record
        if record.gate is not None and (outcome := record.gate.outcome()) is not None:
            return outcome
        leaf, execution = self.leaf, self.execution
        execution.ticked[0] = record.id
        before = self.status
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
            try:
                status = self._update()
            except (Exception, SystemExit) as error:
                self._report(error)
                status = _FAILURE
            if status is not _RUNNING and not (status is _SUCCESS and self._just_updates):
                status = self._handle_result(status)
        if status is not before:
            self.status = leaf.status = status
        if record.status is not status or leaf.feedback_message != record.message:
            execution.update_record(record, status)
        if execution.visited is not None:
            execution.visited.append((self, status))
        return status

    def initialise(self) -> None:
        """Start the leaf; before a leaf that claims something, halt pre-emptible nodes."""
        execution, robot_leaf = self.execution, self.robot_leaf
        if robot_leaf is not None and robot_leaf.claims:
            execution.halt_preemptible()
        self.active, self.broken, self._paused = True, False, False
        if execution.starts is not None:
            execution.starts(self)
        self.leaf.feedback_message = ""
        if robot_leaf is not None:
            robot_leaf.failure = None
        if self.latches and not self._safely(self._take_ports):
            self.active = False  # the behaviour has not begun
        elif self._initialise is not None:
            self._safely(self._initialise)

    def _take_ports(self) -> None:
        for latch in self.latches:
            latch.take()

    def terminate(self, new_status: Status) -> None:
        """Halt the leaf if it is running; `execute_tick` has handled its other ends."""
        if self.active:
            self.active = False
            if self._terminate is not None and not self._safely(self._terminate, new_status):
                self._stop_robot()
            if self._outputs is not None:
                self._outputs.drop()
        if new_status is _INVALID and self.record.status is not _INVALID:
            self.execution.change_status(self.record, new_status)

    def stop(self, new_status: Status = _INVALID) -> None:
        """Stop the leaf, as py_trees' Behaviour.stop does."""
        self.terminate(new_status)
        self.status = self.leaf.status = new_status

    def pause(self, now: float) -> None:
        """Begin a pause of the behaviour if it is running."""
        if self.active and self.robot_leaf is not None:
            self._paused = True
            self._safely(self.robot_leaf.pause, now)

    def resume(self, now: float) -> None:
        """End its pause."""
        if self.active and self._paused and self.robot_leaf is not None:
            self._paused = False
            self._safely(self.robot_leaf.resume, now)

    def _update_with_outputs(self) -> Status:
        """Update the behaviour and write its outputs."""
        status = self.leaf.update()
        if self._outputs is not None and status is not _FAILURE:
            self._outputs.settle(status)
        return status

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
        begun, self.active = self.active, False
        if begun and self._terminate is not None and not self._safely(self._terminate, status):
            status = _FAILURE
        if self._outputs is not None and not self._safely(self._outputs.settle, status):
            status = _FAILURE
        if self.broken:
            self._stop_robot()
        if status is _FAILURE and not self.broken:
            failure = self.robot_leaf.failure if self.robot_leaf is not None else None
            sentence = self.leaf.feedback_message or "failed"
            self.execution.fail(self, failure or Failure(FailureCode.FAILED, sentence))
        return status

    def _stop_robot(self) -> None:
        """Cancel the motion of a behaviour that raised an exception and may not have ended it."""
        if self.robot_leaf is None:
            return
        RobotBehaviour.terminate(self.robot_leaf, _INVALID)
        if "base" in self.robot_leaf.claims:
            self.execution.robot.base.drive_for(STANDSTILL, STOP_TIME)

    def _safely(self, call: Callable[..., Any], *arguments: Any) -> bool:
        ticked = self.execution.ticked
        before, ticked[0] = ticked[0], self.record.id
        try:
            call(*arguments)
        except (Exception, SystemExit) as error:
            self._report(error)
            return False
        finally:
            ticked[0] = before
        return True

    def _report(self, error: BaseException) -> None:
        """Turn an exception into the leaf's failure; those with a code need no traceback."""
        if isinstance(error, EvaluationError):
            self._fail(error.code, error.sentence)
            return
        if isinstance(error, NavigationError):
            self._fail(error.failure.code, error.failure.sentence)
            return
        sentence = exception_sentence(error)
        self.execution.log(f"{self.name}\n{format_exc()}")
        self._fail(FailureCode.EXCEPTION, sentence)
        self._emit(sentence)

    def _fail(self, code: str, sentence: str) -> None:
        self.broken = True
        failure = Failure(code, sentence)
        if self.robot_leaf is not None:
            self.robot_leaf.failure = failure
        self.execution.fail(self, failure)

    def _emit(self, sentence: str) -> None:
        self.execution.emit(
            level="error", kind="exception", text=f"{self.name}: {sentence}",
            fields={"node": self.record.id, "name": self.name},
        )  # fmt: skip
