"""A task whose outcome a test of a behaviour sets."""

from __future__ import annotations

from dataclasses import dataclass

from stack.types import Failure, FailureCode, Path, TaskStatus


@dataclass
class ScriptedTask:
    """A task whose outcome the test sets."""

    status: TaskStatus = TaskStatus.RUNNING
    feedback: str = ""
    failure: Failure | None = None
    distance_remaining: float = 0.0
    path: Path | None = None

    def succeed(self, path: Path | None = None) -> None:
        """End the task with success."""
        self.status, self.path = TaskStatus.SUCCEEDED, path

    def fail(self, code: str = FailureCode.FAILED, sentence: str = "failed by the test") -> None:
        """End the task with a failure."""
        self.status, self.failure = TaskStatus.FAILED, Failure(code, sentence)

    def cancel(self) -> None:
        """Cancel the task; no effect after its end."""
        if self.status is TaskStatus.RUNNING:
            self.status = TaskStatus.CANCELLED
            self.failure = Failure(FailureCode.CANCELLED, "cancelled")
