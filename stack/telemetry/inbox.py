"""Received commands: which are accepted, and in which order they are applied."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace

from stack.telemetry.records import Ack, Command, RunInfo

STOP = "estop"

MOVING = frozenset({"release", "resume", "continue", "step", "set_goal", "teleop"})
"""Commands that an emergency stop cancels if they still wait: after them a robot may move."""

COMMANDS_PER_SECOND = 100.0
"""Commands of one client that are accepted in a wall second, emergency stops apart."""

MAX_WAITING = 500
"""Commands of all clients that may wait to be applied, emergency stops apart."""

MAX_APPLIED = 20
"""Commands applied between two steps, so that an emergency stop never waits for many others."""

MAX_STOPS, STOPS_OF_ONE = 32, 4
"""Emergency stops that may wait, of all clients and of one client. They are applied together."""

MAX_SENDERS = 256
"""Clients whose budgets are remembered."""


@dataclass(frozen=True, slots=True)
class _Waiting:
    """A command that is not applied yet; `own_id` is the id that its sender gave it."""

    sender: bytes
    own_id: str
    command: Command


@dataclass(slots=True)
class _Budget:
    """Commands that a sender may send now, and the wall time at which that was counted."""

    left: float
    at: float


class CommandInbox:
    """Commands for one run, from all clients.

    A command for another run is refused, and so is one beyond the sender's budget. An emergency
    stop is never refused: it is applied before all other commands, and what was sent before it and
    could move the robot is refused. Of many stops only some are kept; they are applied together.

    Args:
        info: of the run.
        clock: returns wall seconds.
    """

    def __init__(self, info: RunInfo, clock: Callable[[], float]) -> None:
        self._info, self._clock = info, clock
        self._stops: deque[_Waiting] = deque()
        self._others: deque[_Waiting] = deque()
        self._applied: dict[str, _Waiting] = {}
        self._budgets: dict[bytes, _Budget] = {}
        self._count = 0

    def receive(self, sender: bytes, command: Command) -> list[tuple[bytes, Ack]]:
        """Accept or refuse a command; return the answers to send at once, with their addressees."""
        refusal = self._refusal(sender, command)
        if refusal:
            return [(sender, Ack(command.id, False, refusal))]
        if command.kind == STOP and self._has_stops_of(sender):
            done = Ack(command.id, True, "an emergency stop is already being applied")
            return [(sender, done), *self._refuse_moving()]
        self._count += 1
        waiting = _Waiting(sender, command.id, replace(command, id=str(self._count)))
        if command.kind != STOP:
            self._others.append(waiting)
            return []
        self._stops.append(waiting)
        return self._refuse_moving()

    def take(self) -> list[Command]:
        """Return the next commands to apply, with ids that are unique across the senders."""
        others = [self._others.popleft() for _ in range(min(MAX_APPLIED, len(self._others)))]
        taken = [*self._stops, *others]
        self._stops.clear()
        for waiting in taken:
            self._applied[waiting.command.id] = waiting
        while len(self._applied) > MAX_WAITING:  # nobody acknowledges these any more
            del self._applied[next(iter(self._applied))]
        return [waiting.command for waiting in taken]

    def addressed(self, ack: Ack) -> tuple[bytes, Ack] | None:
        """Return the sender of the command with this id, and its Ack; None for another command."""
        waiting = self._applied.pop(ack.id, None)
        return None if waiting is None else (waiting.sender, replace(ack, id=waiting.own_id))

    def _refusal(self, sender: bytes, command: Command) -> str:
        if command.run != self._info.identity:
            meant = f"run {command.run[:8]!r}" if command.run else "no run"
            return (
                f"the command is for {meant}, this is {self._info.run_id!r}"
                f" ({self._info.identity[:8]})"
            )
        if command.kind == STOP:
            return ""
        if not self._is_within_budget(sender) or len(self._others) >= MAX_WAITING:
            return f"too many commands: at most {COMMANDS_PER_SECOND:g} in a second are accepted"
        return ""

    def _has_stops_of(self, sender: bytes) -> bool:
        """Whether enough emergency stops wait, of this sender or of all."""
        own = sum(waiting.sender == sender for waiting in self._stops)
        return own >= STOPS_OF_ONE or len(self._stops) >= MAX_STOPS

    def _is_within_budget(self, sender: bytes) -> bool:
        """Count a command of a sender; return whether its budget allows it."""
        now = self._clock()
        budget = self._budgets.pop(sender, None) or _Budget(COMMANDS_PER_SECOND, now)
        passed = max(0.0, now - budget.at)
        left = min(COMMANDS_PER_SECOND, budget.left + passed * COMMANDS_PER_SECOND)
        self._budgets[sender] = _Budget(max(0.0, left - 1.0), now)  # the newest comes last
        if len(self._budgets) > MAX_SENDERS:
            del self._budgets[next(iter(self._budgets))]
        return left >= 1.0

    def _refuse_moving(self) -> list[tuple[bytes, Ack]]:
        """Remove the waiting commands that could move the robot: a stop came after them."""
        late = [waiting for waiting in self._others if waiting.command.kind in MOVING]
        for waiting in late:
            self._others.remove(waiting)
        reason = "an emergency stop came after it"
        return [(waiting.sender, Ack(waiting.own_id, False, reason)) for waiting in late]
