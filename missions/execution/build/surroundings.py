"""Boxes of a world that an arm must not touch."""

from __future__ import annotations

from stack.geometry.rotations import from_angles
from stack.manipulation.scene import Box, SceneObject
from stack.sim.worlds.world import World


def boxes_of(world: World) -> list[SceneObject]:
    """Return the boxes of a world, map frame; those of one name get numbers."""
    found: list[SceneObject] = []
    names: set[str] = set()
    for box in world.boxes:
        at, height = box.pose, box.elevation + box.size[2] / 2.0
        name = first = box.name or "a box"
        number = 1
        while name in names:
            number += 1
            name = f"{first} {number}"
        names.add(name)
        pose = from_angles((at.x, at.y, height), (0.0, 0.0, at.heading))
        found.append(SceneObject(name, Box(box.size), pose))
    return found
