"""What stands between a leaf and the tree: exceptions become failures, starts and ends pair up."""

from __future__ import annotations

from traceback import format_exc

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from missions.language.scope import NotSet
from missions.trees.execution import Execution
from stack.types import Failure, FailureCode


class LeafGuard:
    """Takes the place of a leaf's initialise, update and terminate.

    Whatever they raise becomes FAILURE of that leaf with code EXCEPTION, the traceback goes to the
    log, and the tree stays whole. The leaf's own `terminate` is called exactly once after each
    `initialise`: py_trees alone calls it again whenever a finished parent is reset. `once` is the
    leaf's tick as a direct call.
    """

    def __init__(self, leaf: Behaviour, execution: Execution) -> None:
        self.leaf, self.execution = leaf, execution
        self.moves = bool(getattr(leaf, "uses_wheels", False))
        self.active, self.broken = False, False
        self._initialise, self._update, self._terminate = (
            leaf.initialise, leaf.update, leaf.terminate,
        )  # fmt: skip
        for name in ("initialise", "update", "terminate", "once"):
            setattr(leaf, name, getattr(self, name))

    def initialise(self) -> None:
        """Start the leaf; a leaf that moves the robot has the wheels to itself first."""
        if self.moves:
            self.execution.free_the_wheels()
        self.active, self.broken = True, False
        self.execution.starts(self.leaf)
        self.leaf.feedback_message = ""
        if hasattr(self.leaf, "failure"):
            self.leaf.failure = None
        self.broken = not self._safely("initialise")

    def once(self) -> Status:
        """Tick the leaf as py_trees' Behaviour.tick does, without its generator."""
        leaf = self.leaf
        if leaf.status is not Status.RUNNING:
            self.initialise()
        status = self.update()
        if status is not Status.RUNNING:
            leaf.stop(status)
        leaf.status = status
        self.execution.answered(leaf, status)
        return status

    def update(self) -> Status:
        """Tick the leaf; it has ended properly before the tree knows its outcome."""
        status = Status.FAILURE if self.broken else self._updated()
        if status is not Status.RUNNING:
            self.active = False
            if not self._safely("terminate", status):
                status = Status.FAILURE
        if status is Status.FAILURE and not self.broken:
            failure = getattr(self.leaf, "failure", None)
            said = self.leaf.feedback_message or "failed"
            self.execution.fail(self.leaf, failure or Failure(FailureCode.FAILED, said))
        return status

    def terminate(self, new_status: Status) -> None:
        """Halt the leaf if it is under way; ends of its own were dealt with in `update`."""
        if self.active:
            self.active = False
            self._safely("terminate", new_status)
        if new_status is Status.INVALID:
            self.execution.became(self.leaf, new_status)

    def _updated(self) -> Status:
        try:
            status = self._update()
        except NotSet as error:
            self._fail(FailureCode.FAILED, str(error))
            return Status.FAILURE
        except (Exception, SystemExit) as error:
            self._report(error)
            return Status.FAILURE
        if status in (Status.RUNNING, Status.SUCCESS, Status.FAILURE):
            return status
        said = f"update returned a {type(status).__name__}, wanted is RUNNING, SUCCESS or FAILURE"
        self._fail(FailureCode.EXCEPTION, said)
        self._tell(said)
        return Status.FAILURE

    def _safely(self, method: str, *arguments: Status) -> bool:
        call = self._initialise if method == "initialise" else self._terminate
        try:
            call(*arguments)
        except NotSet as error:
            self._fail(FailureCode.FAILED, str(error))
            return False
        except (Exception, SystemExit) as error:
            self._report(error)
            return False
        return True

    def _report(self, error: BaseException) -> None:
        said = f"{type(error).__name__}: {error}"
        self.execution.log(f"{self.leaf.name}\n{format_exc()}")
        self._fail(FailureCode.EXCEPTION, said)
        self._tell(said)

    def _fail(self, code: FailureCode, sentence: str) -> None:
        self.broken = True
        failure = Failure(code, sentence)
        if hasattr(self.leaf, "failure"):
            self.leaf.failure = failure
        self.execution.fail(self.leaf, failure)

    def _tell(self, said: str) -> None:
        self.execution.emit(
            level="error", kind="exception", text=f"{self.leaf.name}: {said}",
            fields={"node": self.execution.record(self.leaf).id, "name": self.leaf.name},
        )  # fmt: skip
