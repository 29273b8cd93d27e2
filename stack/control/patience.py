"""Standing before something in the way for a while before giving up."""

from __future__ import annotations

from stack.errors import NavigationError
from stack.types import STANDSTILL, FailureCode, Twist


class Patience:
    """Turns "nothing safe to drive" into a standstill, and after a while into a failure."""

    def __init__(self) -> None:
        self._since: float | None = None

    def bear(self, chosen: Twist | None, time: float, patience: float) -> Twist:
        """The chosen twist; standstill while there is none, for as long as patience lasts.

        Args:
            chosen: None when nothing safe can be commanded.
            time: now, seconds.
            patience: seconds to wait.

        Raises:
            NavigationError: COLLISION_AHEAD once patience is over.
        """
        if chosen is not None:
            self._since = None
            return chosen
        if self._since is None:
            self._since = time
        waited = time - self._since
        if waited >= patience:
            raise NavigationError(
                FailureCode.COLLISION_AHEAD,
                f"something stands in the way ahead; waited {waited:.1f} s for it",
            )
        return STANDSTILL
