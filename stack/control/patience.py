"""Waiting time in front of an obstacle before the controller fails."""

from __future__ import annotations

from stack.errors import NavigationError
from stack.lifecycle import Timers
from stack.types import STANDSTILL, FailureCode, Twist


class Patience:
    """Replaces a missing safe command by a standstill, and after a while by a failure."""

    def __init__(self) -> None:
        self.timers = Timers()
        self._blocked = self.timers.new()

    def resolve(self, chosen: Twist | None, time: float, patience: float) -> Twist:
        """Return the chosen twist, or a standstill while there is none.

        Args:
            chosen: None when there is no safe command.
            time: now, seconds.
            patience: seconds to wait.

        Raises:
            NavigationError: COLLISION_AHEAD after waiting for `patience`.
        """
        if chosen is not None:
            self._blocked.reset()
            return chosen
        self._blocked.start_once(time)
        waited = self._blocked.elapsed(time)
        if waited >= patience:
            raise NavigationError(
                FailureCode.COLLISION_AHEAD,
                f"an obstacle blocks the path ahead; waited {waited:.1f} s for it to clear",
            )
        return STANDSTILL
