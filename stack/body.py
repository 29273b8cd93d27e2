"""Body: the common interface of simulated, real and replayed robots.

Time is `body.time`; only `wait` advances it. A body stops by itself when it has received no drive
command for DEAD_MAN seconds of its own time.
"""

from __future__ import annotations

from typing import Protocol

from stack.drivetrain.description import RobotDescription
from stack.types import Observation, Twist

DEAD_MAN = 0.3
"""Seconds without a drive command after which a body stops."""


class Body(Protocol):
    """Interface of a robot: sensors and drive."""

    @property
    def description(self) -> RobotDescription:
        """Description of the robot."""
        ...

    @property
    def time(self) -> float:
        """Seconds on the body's clock; 0 when the run began."""
        ...

    def sense(self) -> Observation:
        """Return the measurements since the last call."""
        ...

    def drive(self, twist: Twist) -> None:
        """Command a velocity; the body applies acceleration limits and the dead-man stop."""
        ...

    def ask_for_image(self) -> None:
        """Request a camera picture; an observation delivers it `latency` seconds later.

        Does nothing if a picture is pending, the camera's period has not passed, or there is no
        camera. Pictures are rendered only on request.
        """
        ...

    def wait(self, period: float) -> None:
        """Advance time by `period` seconds: step the physics, or sleep on hardware."""
        ...

    def close(self) -> None:
        """Stop the robot and disconnect from it. Safe to call twice."""
        ...
