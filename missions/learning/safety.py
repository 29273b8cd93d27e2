"""A safety stage that lets every velocity pass, for learning in a simulation."""

from __future__ import annotations

from stack.drivetrain.description import RobotDescription
from stack.safety.stage import LimitedTwist, SafetyStage
from stack.types import STANDSTILL, ContactZone, Limitation, Perceived, Twist
from stack.types.limitations import EMERGENCY_STOP, STOPPED


class NoSafety(SafetyStage):
    """Limits a velocity only to what the drive can do; an emergency stop still stops.

    Args:
        robot: with its drive.
    """

    def __init__(self, robot: RobotDescription) -> None:
        self._robot = robot

    def limit(
        self, twist: Twist, perceived: Perceived, *, emergency_stop: str = "",
        contact: ContactZone | None = None,
    ) -> LimitedTwist:  # fmt: skip
        """Return the twist as the drive can move, as `SafetyStage`."""
        if emergency_stop:
            return LimitedTwist(STANDSTILL, Limitation(STOPPED, EMERGENCY_STOP, emergency_stop))
        return LimitedTwist(self._robot.drivetrain.feasible(self._robot.limits.clipped(twist)))
