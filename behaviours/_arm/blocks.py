"""Blocks as mission files write them, and the choice among those that were detected."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from math import cos, pi, sin

import numpy as np

from stack.parameters import parameter
from stack.types import OBJECT_COLOURS, Block, FloatArray, ObjectColour, on_floor

ABOVE = 0.1
"""Metres over its place at which a block is lowered, and the tool is raised to."""

DROP = 0.004
"""Metres that a block falls when the fingers open: errors of heights stay below."""

GRID = 0.04
"""Metres between two places that are considered."""

GAP = 0.025
"""Metres between two blocks: cameras see them as two. The planner finds out whether fingers fit."""

TURNS = (0.0, pi / 2.0, pi, -pi / 2.0)
"""Radians about the vertical; a block looks the same."""

ROUNDING = 1e-9
"""Metres."""

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


def where(pose: FloatArray) -> str:
    """Return the place of a pose (4, 4) on its table for people: `(0.50, -0.10)`, metres."""
    return f"({pose[0, 3]:.2f}, {pose[1, 3]:.2f})"


def nearest_first(blocks: Iterable[Block]) -> list[Block]:
    """Return blocks in the order of their distance from the arm."""
    return sorted(blocks, key=lambda block: float(np.hypot(*block.pose[:2, 3])))


def on_top(block: Block) -> tuple[float, float, float, float]:
    """Return the middle of the top of a block: x, y, z and yaw."""
    x, y, z = block.pose[:3, 3].tolist()
    return x, y, z + block.size[2] / 2.0, on_floor(block.pose).heading


def free_places(
    box: tuple[FloatArray, FloatArray], placed: Block, others: Iterable[Block]
) -> Iterator[tuple[float, float, float, float]]:
    """Yield where a block can stand on a box, the places nearest to the middle first.

    Args:
        box: its pose (4, 4) and size (3,).
        placed: the block.
        others: that stand there.

    Yields:
        x, y and z of the underside, metres, and yaw, in the frame of the poses; one for each turn.
    """
    pose, size = box
    there = [(other.pose, other.size) for other in others]
    xs, ys = (GRID * np.arange(-count, count + 1) for count in np.floor(size[:2] / 2.0 / GRID))
    columns, rows = (axis.ravel() for axis in np.meshgrid(xs, ys))
    for index in np.argsort(np.hypot(columns, rows), kind="stable"):
        for turn in TURNS:
            local = standing(columns[index], rows[index], size[2] / 2.0, turn)
            over = np.abs(_points(local, placed.size)) - size[:2] / 2.0
            if over.max() > ROUNDING:
                continue
            at = pose @ local
            if all(_gap((at, placed.size), other) > GAP for other in there):
                yield *at[:3, 3].tolist(), on_floor(at).heading


def _points(pose: FloatArray, size: FloatArray) -> FloatArray:
    """Return points (25, 2) of a block seen from above, its corners among them."""
    steps = np.linspace(-0.5, 0.5, 5)
    local = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2) * size[:2]
    return np.asarray(local @ pose[:2, :2].T + pose[:2, 3])


def _gap(one: tuple[FloatArray, FloatArray], other: tuple[FloatArray, FloatArray]) -> float:
    """Return the distance of two blocks, as pose and size, seen from above; 0 if they overlap."""
    return min(_distance(one, other), _distance(other, one))


def _distance(one: tuple[FloatArray, FloatArray], other: tuple[FloatArray, FloatArray]) -> float:
    """Return the distance of the points of a block from another one, metres."""
    pose, size = other
    local = (_points(*one) - pose[:2, 3]) @ pose[:2, :2]
    outside = np.maximum(np.abs(local) - size[:2] / 2.0, 0.0)
    return float(np.hypot(*outside.T).min())
