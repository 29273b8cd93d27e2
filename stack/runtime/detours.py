"""Detours: motions that an operator lets the robot make while the mission is paused."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from stack.robot import Task
from stack.runtime.interfaces import DetourTree
from stack.types import Failure, FailureCode, TaskStatus

RUNNING, CANCELLED = "running", "cancelled"

_OUTCOMES = {
    TaskStatus.RUNNING: RUNNING, TaskStatus.SUCCEEDED: "success",
    TaskStatus.FAILED: "failure", TaskStatus.CANCELLED: CANCELLED,
}  # fmt: skip


@dataclass
class _Detour:
    """A drive, or a behaviour.

    Attributes:
        what: name of its behaviour.
        tag: chosen by the sender of the command; returned in the event of its end.
        halted: a behaviour was halted before it ended.
    """

    what: str
    tag: str
    run: Task | DetourTree
    halted: bool = False

    @property
    def outcome(self) -> str:
        """running | success | failure | cancelled."""
        if isinstance(self.run, DetourTree):
            return CANCELLED if self.halted else self.run.outcome
        return _OUTCOMES[self.run.status]

    @property
    def failure(self) -> Failure:
        """Why it did not succeed."""
        code = FailureCode.CANCELLED if self.outcome == CANCELLED else FailureCode.FAILED
        return self.run.failure or Failure(code, self.outcome)

    def cancel(self) -> None:
        if isinstance(self.run, DetourTree):
            self.halted = True
            self.run.halt()
        else:
            self.run.cancel()


class Detours:
    """Runs at most one detour, and emits an event `detour` when it has ended.

    Args:
        emit: called with (kind, text, level=…, **fields).

    Attributes:
        is_held: whether the detour is paused.
    """

    def __init__(self, emit: Callable[..., object]) -> None:
        self._emit, self._current, self.is_held = emit, list[_Detour](), False

    @property
    def is_running(self) -> bool:
        """Whether a detour has begun and not ended."""
        return any(detour.outcome == RUNNING for detour in self._current)

    def begin(self, what: str, tag: str, run: Task | DetourTree) -> None:
        """Begin a detour; the one before ends.

        Args:
            what: name of its behaviour.
            tag: returned in the event.
            run: a drive that has begun, or a behaviour that `tick` ticks.
        """
        self.cancel()
        self._current = [_Detour(what, tag, run)]
        if isinstance(run, DetourTree):
            run.tick()

    def tick(self) -> None:
        """Tick the behaviour; nothing else needs it."""
        for detour in self._current:
            if isinstance(detour.run, DetourTree) and detour.outcome == RUNNING:
                detour.run.tick()

    def hold(self, now: float, *, held: bool) -> None:
        """Pause the detour at a time, seconds, or let it go on."""
        self.is_held = held
        for detour in self._current:
            if isinstance(detour.run, DetourTree) and detour.outcome == RUNNING:
                (detour.run.pause if held else detour.run.resume)(now)

    def cancel(self) -> None:
        """End the detour; the robot stops."""
        self.is_held = False
        for detour in self._current:
            if detour.outcome == RUNNING:
                detour.cancel()
        self.report()

    def report(self) -> None:
        """Emit the event of a detour that has ended since the last call."""
        for detour in [item for item in self._current if item.outcome != RUNNING]:
            self._current.remove(detour)
            good, failure = detour.outcome == "success", detour.failure
            why = "" if good else f": {failure.code} {failure.sentence}"
            self._emit(
                "detour", f"detour {detour.what}: {detour.outcome}{why}", source="command",
                level="info" if good else "warning", behaviour=detour.what, tag=detour.tag,
                status=detour.outcome, code="" if good else str(failure.code),
                reason="" if good else failure.sentence,
            )  # fmt: skip
