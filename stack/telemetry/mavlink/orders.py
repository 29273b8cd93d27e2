"""Orders to the engine, each with what is done when the engine has answered."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from stack.telemetry.mavlink.handover import Handover
from stack.telemetry.records import Ack, Command

Done = Callable[[str], None]
"""done(refusal): the order was applied, or why it was refused."""

TIME_LIMIT = 30.0
"""Wall seconds after which an order without an answer counts as refused."""

STOP = "estop"


def ignore(refusal: str) -> None:
    """Wait for no answer."""


class Orders:
    """Gives commands to the engine and calls back with its answers.

    Args:
        handover: to the engine's thread.
        clock: returns wall seconds.
    """

    def __init__(self, handover: Handover, clock: Callable[[], float]) -> None:
        self._handover, self._clock, self._count = handover, clock, 0
        self._open: dict[str, tuple[Done, float]] = {}
        self._later: list[Callable[[], None]] = []

    def give(self, kind: str, done: Done = ignore, **arguments: Any) -> None:
        """Give a command of the engine; `done` is called once, now or later."""
        self._count += 1
        command = Command(str(self._count), kind, arguments)
        if not self._handover.order(command, urgent=kind == STOP):
            done("too many commands wait for the engine")
            return
        self._open[command.id] = done, self._clock() + TIME_LIMIT

    def chain(self, kinds: list[str], done: Done = ignore) -> None:
        """Give commands without arguments, each after the one before; stop at a refusal."""

        def next_step(refusal: str) -> None:
            if refusal or not kinds:
                done(refusal)
            else:
                self.give(kinds.pop(0), next_step)

        next_step("")

    def later(self, action: Callable[[], None]) -> None:
        """Call an action in the next `settle`: a long chain of them needs no deep stack."""
        self._later.append(action)

    def settle(self) -> None:
        """Call back for the new answers, and for orders without one for too long."""
        now = self._clock()
        due, self._later = self._later, []
        for action in due:
            action()
        for ack in self._handover.take_acks():
            self._answer(ack)
        for number in [number for number, (_, limit) in self._open.items() if now > limit]:
            self._answer(Ack(number, False, f"the engine gave no answer for {TIME_LIMIT:g} s"))

    def _answer(self, ack: Ack) -> None:
        done, _ = self._open.pop(ack.id, (ignore, 0.0))
        done("" if ack.done else ack.reason or "refused")
