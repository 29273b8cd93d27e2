"""Door that closes."""

from __future__ import annotations

from dataclasses import dataclass

from stack.drivetrain.description import RobotDescription
from stack.parameters import parameter, suggestion
from stack.sim.faults.fault import Fault, Target
from stack.sim.worlds.world import World
from stack.types import MovedDoor


@dataclass(frozen=True)
class DoorParameters:
    """Parameters of `ClosedDoor`."""

    door: str = parameter("", help="its name; default: the nearest one", public=True)


class ClosedDoor(Fault):
    """A door closes; it opens again at the end."""

    Parameters = DoorParameters

    @classmethod
    def lack(cls, parameters: DoorParameters, robot: RobotDescription, world: World) -> str:
        """Return that the world has no such door."""
        names = [door.name for door in world.doors]
        if not names:
            return f"the world {world.name} has no doors"
        if parameters.door and parameters.door not in names:
            return f"there is no door {parameters.door!r}; {suggestion(parameters.door, names)}"
        return ""

    def begin(self, target: Target) -> None:
        """Close the door."""
        before = dict(target.simulation.doors)
        target.disturb(MovedDoor(self.parameters.door, closed=True))
        self._moved = [
            name for name, closed in target.simulation.doors.items() if closed != before[name]
        ]

    def end(self, target: Target) -> None:
        """Open it, if it was open."""
        for name in self._moved:
            target.disturb(MovedDoor(name, closed=False))
