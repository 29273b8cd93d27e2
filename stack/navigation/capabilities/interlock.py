"""What must be true of the rest of the robot before its base may drive."""

from __future__ import annotations

from abc import ABC, abstractmethod

from stack.types import Failure, Limitation, Perceived


class DriveInterlock(ABC):
    """Holds the base while another part of the robot must not be moved with it."""

    @abstractmethod
    def hindrance(self, perceived: Perceived) -> Limitation | None:
        """Return why the base must stand in this step; None if it may drive."""

    @abstractmethod
    def remove_hindrance(self, perceived: Perceived) -> Failure | None:
        """Bring the robot towards a state in which the base may drive; called in each step.

        Returns:
            Why that is not possible; the motion of the base then fails.
        """
