"""The only seam between simulated, real and replayed robots.

Time is `body.time`; only `wait` lets it pass. A body stops by itself when it has not been driven
for DEAD_MAN seconds of its own time.
"""

from __future__ import annotations

from typing import Protocol

from stack.drivetrain.description import RobotDescription
from stack.types import Observation, Twist

DEAD_MAN = 0.3
"""Seconds without a drive command after which a body stops."""


class Body(Protocol):
    """A robot to sense with and to drive."""

    @property
    def description(self) -> RobotDescription:
        """What kind of robot this is."""
        ...

    @property
    def time(self) -> float:
        """Seconds on the body's clock; 0 when the run began."""
        ...

    def sense(self) -> Observation:
        """What came in since the last call."""
        ...

    def drive(self, twist: Twist) -> None:
        """Command a velocity; acceleration limits and the dead-man stop are the body's own."""
        ...

    def ask_for_image(self) -> None:
        """Wish for the next camera picture; it comes with a later observation, `latency` on.

        Does nothing when a picture is already under way, its time has not come, or there is no
        camera. A picture is never rendered unless asked for.
        """
        ...

    def wait(self, period: float) -> None:
        """Let time pass: step the physics, or sleep until the next period on hardware."""
        ...

    def close(self) -> None:
        """Stop the robot and let go of it. Safe to call twice."""
        ...
