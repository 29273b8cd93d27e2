"""What faults of wheels share: which wheels, and their share of power or grip."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

from stack.drivetrain.description import RobotDescription
from stack.sim.faults.fault import Fault, Target
from stack.sim.worlds.world import World

if TYPE_CHECKING:
    from stack.sim.simulated_robot import SimulatedRobot

SIDES = ("left", "right", "all")


class WheelFault(Fault):
    """A fault of the driven wheels of a side, `parameters.side`.

    Attributes:
        grip: whether the wheels lose grip on the floor; otherwise power.
    """

    grip: ClassVar[bool] = False

    @classmethod
    def lack(cls, parameters: Any, robot: RobotDescription, world: World) -> str:
        """Return that the robot has no wheels."""
        return "" if robot.drivetrain.moves else f"{robot.name} has no wheels"

    @property
    def share(self) -> float:
        """Share of the grip or power that is left."""
        return 0.0

    def begin(self, target: Target) -> None:
        """Take it from the wheels."""
        target.robot.impair_wheels(
            dict.fromkeys(self._wheels(target.robot), self.share), grip=self.grip
        )

    def end(self, target: Target) -> None:
        """Give it back."""
        target.robot.impair_wheels(dict.fromkeys(self._wheels(target.robot), 1.0), grip=self.grip)

    def _wheels(self, robot: SimulatedRobot) -> list[int]:
        count = len(robot.description.drivetrain.driven_joints)
        aside = robot.physics.wheel_places[:count, 1].tolist()
        side = self.parameters.side
        return [n for n, y in enumerate(aside) if side == "all" or (y > 0.0) == (side == "left")]
