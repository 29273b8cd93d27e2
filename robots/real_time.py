"""What all bodies of real robots have: the clock of this computer, and the pace of the loop."""

from __future__ import annotations

from time import monotonic  # noqa: TID251 - the clock of a real-time body

from stack.body import Body
from stack.drivetrain.description import RobotDescription
from stack.sim.pace import Pace


class RealTimeBody(Body):
    """A body whose time is the monotonic clock of this computer since the run began.

    Args:
        description: of the robot.
    """

    def __init__(self, description: RobotDescription) -> None:
        self._description = description
        self._began, self._pace = monotonic(), Pace(1.0)

    @property
    def description(self) -> RobotDescription:
        """Description of the robot."""
        return self._description

    @property
    def time(self) -> float:
        """Seconds since the run began."""
        return monotonic() - self._began

    @property
    def is_real_time(self) -> bool:
        """Always: nobody holds this clock."""
        return True

    def wait(self, period: float) -> None:
        """Sleep until the next control period begins."""
        self._pace.advance(period)
        self._pace.rest()

    @property
    def slept(self) -> float:
        """Wall seconds that `wait` has slept so far."""
        return self._pace.slept
