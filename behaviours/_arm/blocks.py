"""Blocks as mission files write them, and the choice among those that were detected."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import atan2, cos, sin

import numpy as np

from stack.parameters import parameter
from stack.types import OBJECT_COLOURS, Block, FloatArray, ObjectColour

ABOVE = 0.1
"""Metres over its place at which a block is lowered, and the tool is raised to."""

DROP = 0.004
"""Metres that a block falls when the fingers open: errors of heights stay below."""

GRID = 0.02
"""Metres between two places that are considered."""

GAP = 0.01
"""Metres between the circles around two blocks. The planner finds out whether a finger fits."""

FOOT = 0.03
"""Metres between a block and the box under it at most: errors of their heights."""


@dataclass(frozen=True)
class KnownBlock:
    """A block whose place is known, in the arm's base link: its centre, and its sizes."""

    x: float = parameter(0.0, "m", help="forward")
    y: float = parameter(0.0, "m", help="to the left")
    z: float = parameter(0.0, "m", help="upwards")
    yaw: float = parameter(0.0, "rad", help="direction of its length")
    length: float = parameter(0.05, "m", above=0.0, help="size along its direction")
    width: float = parameter(0.05, "m", above=0.0, help="size across")
    height: float = parameter(0.05, "m", above=0.0, help="size upwards")
    colour: ObjectColour = parameter("red", one_of=OBJECT_COLOURS, help="for messages")

    def block(self, time: float) -> Block:
        """Return it as if it had been seen now, seconds on the robot's clock."""
        pose = standing(self.x, self.y, self.z, self.yaw)
        size = np.array([self.length, self.width, self.height])
        return Block(self.colour, pose, size, np.zeros((4, 4)), time)


def standing(x: float, y: float, z: float, yaw: float) -> FloatArray:
    """Return an upright pose (4, 4)."""
    pose = np.eye(4)
    pose[:2, :2] = [[cos(yaw), -sin(yaw)], [sin(yaw), cos(yaw)]]
    pose[:3, 3] = x, y, z
    return pose


def is_on(block: Block, box: tuple[FloatArray, FloatArray]) -> bool:
    """Return whether a block stands on a box, given by pose (4, 4) and size (3,)."""
    pose, size = box
    x, y, z = (np.linalg.inv(pose) @ block.pose)[:3, 3]
    gap = z - block.size[2] / 2.0 - size[2] / 2.0
    return bool(abs(x) <= size[0] / 2.0 and abs(y) <= size[1] / 2.0 and abs(gap) < FOOT)


def nearest_first(blocks: Iterable[Block]) -> list[Block]:
    """Return blocks in the order of their distance from the arm."""
    return sorted(blocks, key=lambda block: float(np.hypot(*block.pose[:2, 3])))


def yaw_of(pose: FloatArray) -> float:
    """Return the direction of the x axis of a pose (4, 4), radians."""
    return atan2(pose[1, 0], pose[0, 0])


def on_top(block: Block) -> tuple[float, float, float, float]:
    """Return the middle of the top of a block: x, y, z and yaw."""
    x, y, z = block.pose[:3, 3].tolist()
    return x, y, z + block.size[2] / 2.0, yaw_of(block.pose)


def free_places(
    box: tuple[FloatArray, FloatArray], placed: Block, others: Iterable[Block]
) -> list[tuple[float, float, float, float]]:
    """Return where a block can stand on a box, the places nearest to the middle first.

    Args:
        box: its pose (4, 4) and size (3,).
        placed: the block.
        others: that stand there.

    Returns:
        x, y and z of the underside, metres, and yaw, in the frame of the poses.
    """
    pose, size = box
    radius = float(np.hypot(*placed.size[:2])) / 2.0
    half = np.maximum(size[:2] / 2.0 - radius, 0.0)
    counts = np.floor(half / GRID).astype(int)
    steps = [GRID * np.arange(-count, count + 1) for count in counts]
    xs, ys = (axis.ravel() for axis in np.meshgrid(*steps))
    order = np.argsort(np.hypot(xs, ys), kind="stable")
    local = np.column_stack((xs, ys, np.full(len(xs), size[2] / 2.0)))[order]
    places = local @ pose[:3, :3].T + pose[:3, 3]
    free = np.ones(len(places), dtype=bool)
    for other in others:
        apart = np.hypot(*(places[:, :2] - other.pose[:2, 3]).T)
        free &= apart > radius + float(np.hypot(*other.size[:2])) / 2.0 + GAP
    yaw = yaw_of(pose)
    return [(x, y, z, yaw) for x, y, z in places[free].tolist()]
