"""Turn in place."""

from __future__ import annotations

from py_trees.common import Status

from behaviours.base import RobotBehaviour, port


class Spin(RobotBehaviour):
    """Turn in place by an angle; more than a full turn is allowed."""

    angle: float = port("how far, positive to the left", unit="rad")
    speed: float | None = port(
        "turning speed; the robot's own when left out", unit="rad/s", default=None, above=0.0
    )

    uses_wheels = True

    def initialise(self) -> None:
        """Begin to turn."""
        self._task = self.robot.spin(self.angle, speed=self.speed)

    def update(self) -> Status:
        """Report on the turn."""
        return self.follow(self._task)
