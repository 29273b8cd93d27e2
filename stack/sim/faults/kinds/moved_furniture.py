"""Furniture that stands elsewhere than on the map."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import cos, pi, sin

from stack.drivetrain.description import RobotDescription
from stack.parameters import FARTHEST, parameter
from stack.sim.faults.fault import BEFORE, Fault
from stack.sim.faults.room import keeps_clear, leaves_ways, reachable
from stack.sim.worlds.world import Box, World
from stack.types import Pose2D

ATTEMPTS = 20
"""Places that are tried for a box; then it stays."""


@dataclass(frozen=True)
class FurnitureParameters:
    """Parameters of `MovedFurniture`."""

    share: float = parameter(
        0.3, at_least=0.0, at_most=1.0, help="share of the boxes that are moved", public=True
    )
    distance: float = parameter(
        0.5, "m", above=0.0, at_most=FARTHEST, help="by which they are moved at most", public=True
    )
    turn: float = parameter(0.3, "rad", at_least=0.0, at_most=pi, help="largest turn of a box")


class MovedFurniture(Fault):
    """Boxes of the world stand elsewhere than on the map, from the beginning.

    None is put onto the robot's start, a place, a dock or another thing, or into the only way to
    a place. Only a map that is made
    from the world is wrong then: a saved one has its own boxes.
    """

    Parameters = FurnitureParameters
    kind = BEFORE

    @classmethod
    def lack(cls, parameters: FurnitureParameters, robot: RobotDescription, world: World) -> str:
        """Return that the world has nothing to move."""
        return "" if _movable(world) else f"the world {world.name} has no boxes"

    def changed_world(self, world: World, robot: RobotDescription, start: Pose2D) -> World:
        """Return the world with boxes moved."""
        radius = robot.footprint.circumscribed_radius
        ways, moved = reachable(world, radius, start), world
        for number in _movable(world):
            moves = self.random.random() < self.parameters.share
            tries = [self._moved(world.boxes[number]) for _ in range(ATTEMPTS)]
            for box in tries if moves else ():
                boxes = moved.boxes
                others = replace(moved, boxes=(*boxes[:number], *boxes[number + 1 :]))
                now = replace(moved, boxes=(*boxes[:number], box, *boxes[number + 1 :]))
                if keeps_clear(box, others, radius, start) and leaves_ways(
                    ways, now, radius, start
                ):
                    moved = now
                    break
        return moved

    def _moved(self, box: Box) -> Box:
        away, direction, turn = self.random.random(3).tolist()
        distance, angle = away * self.parameters.distance, 2.0 * pi * direction
        heading = box.pose.heading + (2.0 * turn - 1.0) * self.parameters.turn
        x, y = box.pose.x + distance * cos(angle), box.pose.y + distance * sin(angle)
        return replace(box, pose=Pose2D(x, y, heading))


def _movable(world: World) -> list[int]:
    """Return the numbers of the boxes that are no part of a dock."""
    return [number for number, box in enumerate(world.boxes) if box.name != "dock"]
