"""Shapes of a world for the 3-D view."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import atan2, hypot

from stack.sim.worlds.world import Door, Wall, World
from stack.telemetry.records import SceneShape
from stack.types import Pose2D

BOARD_SCALE, BOARD_THICKNESS = 1.25, 0.01


def scene_of(world: World, doors_closed: Mapping[str, bool]) -> tuple[SceneShape, ...]:
    """Return walls, furniture, closed doors, marker boards and docks, in a fixed order."""
    return tuple(_shapes(world, doors_closed))


def _shapes(world: World, doors_closed: Mapping[str, bool]) -> Iterator[SceneShape]:
    for wall in world.walls:
        yield from _slabs(wall)
    for box in world.boxes:
        yield SceneShape("box", box.pose, box.size, box.colour, lift=box.elevation)
    for drum in world.cylinders:
        size = (2 * drum.radius, 2 * drum.radius, drum.height)
        yield SceneShape("cylinder", Pose2D(drum.x, drum.y), size, drum.colour)
    for door in world.doors:
        if doors_closed.get(door.name, door.closed):
            yield _door(door)
    for marker in world.markers:
        x, y, z = marker.position
        side = BOARD_SCALE * marker.size
        pose = Pose2D(x, y, marker.heading)
        yield SceneShape(
            "box", pose, (BOARD_THICKNESS, side, side), (0.95, 0.95, 0.9), z - side / 2
        )
    for dock in world.docks:
        size = (2 * dock.radius, 2 * dock.radius, 0.01)
        yield SceneShape("cylinder", Pose2D(dock.x, dock.y), size, (0.25, 0.65, 0.45))


def _slabs(wall: Wall) -> Iterator[SceneShape]:
    for (x0, y0), (x1, y1) in zip(wall.points[:-1], wall.points[1:], strict=True):
        length = hypot(x1 - x0, y1 - y0) + wall.thickness
        pose = Pose2D(float(x0 + x1) / 2, float(y0 + y1) / 2, atan2(y1 - y0, x1 - x0))
        yield SceneShape("box", pose, (length, wall.thickness, wall.height), wall.colour)


def _door(door: Door) -> SceneShape:
    (x0, y0), (x1, y1) = door.start, door.end
    pose = Pose2D((x0 + x1) / 2, (y0 + y1) / 2, atan2(y1 - y0, x1 - x0))
    size = (hypot(x1 - x0, y1 - y0), door.thickness, door.height)
    return SceneShape("box", pose, size, door.colour)
