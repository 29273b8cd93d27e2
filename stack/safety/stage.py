"""Interface of the safety stage, and its result."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import NamedTuple

from stack.types import ContactZone, Limitation, Perceived, Twist


class LimitedTwist(NamedTuple):
    """A velocity command, and why it is less than what was wanted; None when it is not."""

    twist: Twist
    limitation: Limitation | None = None

    @property
    def reason(self) -> str:
        """The limitation as a sentence; empty without one."""
        return "" if self.limitation is None else self.limitation.text

    def then(self, later: LimitedTwist) -> LimitedTwist:
        """Return the result of a later stage, with its own limitation or else this one."""
        return LimitedTwist(later.twist, later.limitation or self.limitation)


class SafetyStage(ABC):
    """Limits the velocity that navigation commands."""

    @abstractmethod
    def limit(
        self, twist: Twist, perceived: Perceived, *, emergency_stop: str = "",
        contact: ContactZone | None = None,
    ) -> LimitedTwist:  # fmt: skip
        """Return the limited twist for this step.

        Args:
            twist: commanded velocity, base frame.
            perceived: in this step: measured velocity, obstacles, moving objects, speed limit.
            emergency_stop: reason of the engaged emergency stop; empty if it is released.
            contact: where the robot may touch something; points in it do not stop the robot, which
                drives at most at the contact speed.
        """
