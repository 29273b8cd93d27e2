"""Charging docks with contacts: their shape, and the zone in which a robot may touch them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stack.types.geometry import FloatArray, Pose2D


@dataclass(frozen=True, slots=True)
class DockShape:
    """Outline of a dock at the height of a lidar: a block with a slot in the middle of its face.

    The dock's frame has its origin in the middle of the face, x out of the face. The slot tells
    where along the face the middle is.

    Attributes:
        width: of the block, metres.
        depth: of the block, metres.
        slot_width: metres.
        slot_depth: metres.
    """

    width: float = 0.4
    depth: float = 0.2
    slot_width: float = 0.16
    slot_depth: float = 0.1

    @property
    def outline(self) -> FloatArray:
        """(8, 2) metres, from the right rear corner along the face to the left one."""
        half, slot = self.width / 2.0, self.slot_width / 2.0
        right = [
            (-self.depth, -half), (0.0, -half), (0.0, -slot), (-self.slot_depth, -slot),
        ]  # fmt: skip
        left = [(x, -y) for x, y in reversed(right)]
        return np.array([*right, *left])


@dataclass(frozen=True, slots=True)
class ContactZone:
    """A rectangle around a thing that the robot is to touch; its points do not stop the robot.

    Attributes:
        pose: of the middle of the rectangle, odom frame.
        length: along the heading, metres.
        width: metres.
    """

    pose: Pose2D
    length: float
    width: float

    def contains(self, points: FloatArray) -> NDArray[np.bool_]:
        """Return which points (n, 2), odom frame, are inside."""
        local = np.abs(self.pose.inverse().transform(points))
        inside: NDArray[np.bool_] = (local[:, 0] <= self.length / 2.0) & (
            local[:, 1] <= self.width / 2.0
        )
        return inside
