"""What every request to the robot that takes time is."""

from __future__ import annotations

from typing import Protocol

from stack.types import Failure, Path, TaskStatus


class Task(Protocol):
    """A request to the robot that takes time. Keeps its own outcome."""

    @property
    def status(self) -> TaskStatus:
        """RUNNING until the task succeeds, fails or is cancelled; does not change after that."""

    @property
    def feedback(self) -> str:
        """Short progress text for the operator, e.g. `3.2 m to go`."""

    @property
    def failure(self) -> Failure | None:
        """Why it failed or was cancelled; None otherwise."""

    @property
    def distance_remaining(self) -> float:
        """Remaining distance, metres (radians for a spin); 0 if unknown or over."""

    @property
    def path(self) -> Path | None:
        """The current path, or the result of `plan`; None without one."""

    def cancel(self) -> None:
        """Cancel the task and stop the robot. Does nothing if the task is over."""
