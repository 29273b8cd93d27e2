"""Poses of a tool as mission files write them."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, pi, sin

import numpy as np

from stack.parameters import parameter
from stack.types import FloatArray


@dataclass(frozen=True)
class ToolPose:
    """A pose in the arm's base link: x forward, y left, z up from where the arm is mounted."""

    x: float = parameter(0.0, "m", help="forward")
    y: float = parameter(0.0, "m", help="to the left")
    z: float = parameter(0.0, "m", help="upwards")
    roll: float = parameter(pi, "rad", help="about x; 180 deg: the tool looks down")
    pitch: float = parameter(0.0, "rad", help="about y, after roll")
    yaw: float = parameter(0.0, "rad", help="about z, after pitch")

    def matrix(self) -> FloatArray:
        """Return the pose (4, 4), metres."""
        (cr, cp, cy), (sr, sp, sy) = (
            tuple(map(f, (self.roll, self.pitch, self.yaw))) for f in (cos, sin)
        )
        return np.array([
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr, self.x],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr, self.y],
            [-sp, cp * sr, cp * cr, self.z],
            [0.0, 0.0, 0.0, 1.0],
        ])  # fmt: skip
