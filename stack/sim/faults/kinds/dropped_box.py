"""Box on the robot's way."""

from __future__ import annotations

from dataclasses import dataclass

from stack.drivetrain.description import RobotDescription
from stack.parameters import FARTHEST, parameter
from stack.sim.faults.fault import NOW, Fault, Target, outside
from stack.sim.worlds.world import World
from stack.types import DroppedBox, Pose2D


@dataclass(frozen=True)
class BoxParameters:
    """Parameters of `Box`."""

    x: float | None = parameter(
        None, "m", at_least=-FARTHEST, at_most=FARTHEST, public=True,
        help="x and y of its middle; default: a metre before the robot",
    )  # fmt: skip
    y: float | None = parameter(
        None, "m", at_least=-FARTHEST, at_most=FARTHEST, help="with x", public=True
    )
    side: float = parameter(0.4, "m", at_least=0.05, at_most=3.0, help="length and width")
    height: float = parameter(0.5, "m", at_least=0.05, at_most=3.0, help="height")


class Box(Fault):
    """Somebody puts down a box, where the map has none. Cameras do not see it."""

    Parameters = BoxParameters
    kind = NOW

    @classmethod
    def lack(cls, parameters: BoxParameters, robot: RobotDescription, world: World) -> str:
        """Return that the place is not in the world."""
        x, y = parameters.x, parameters.y
        return "" if x is None or y is None else outside(world, x, y)

    def begin(self, target: Target) -> None:
        """Put it down."""
        p = self.parameters
        at = None if p.x is None or p.y is None else Pose2D(p.x, p.y)
        target.disturb(DroppedBox(at, (p.side, p.side, p.height)))
