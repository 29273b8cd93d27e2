"""State of everything in a world that moves: what sensors see besides the static parts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from stack.types import FloatArray, Footprint, Pose2D


@dataclass(frozen=True, slots=True)
class RobotShape:
    """Another robot as range sensors see it: an upright prism over its footprint.

    Attributes:
        pose: of its base frame, world frame.
        footprint: in its base frame.
        height: metres, from its robot.yaml. The prism is wider than a mast on top of the robot.
    """

    pose: Pose2D
    footprint: Footprint
    height: float

    def edges(self) -> FloatArray:
        """Return the sides (n, 4) of the footprint: x, y, x, y in metres, world frame."""
        corners = self.pose.transform(self.footprint.points)
        return np.column_stack([corners, np.roll(corners, -1, axis=0)])


def _nobody() -> FloatArray:
    return np.zeros((0, 3))


@dataclass(frozen=True, slots=True)
class SceneState:
    """People, doors and other robots at one time.

    Attributes:
        people: (n, 3) x, y, radius, world frame, metres.
        doors: name -> closed.
        robots: all but the one that carries the sensor.
    """

    people: FloatArray = field(default_factory=_nobody)
    doors: Mapping[str, bool] = field(default_factory=dict)
    robots: tuple[RobotShape, ...] = ()
