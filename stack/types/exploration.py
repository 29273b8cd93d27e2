"""Where a robot can look at unknown space, and lanes that cover an area."""

from __future__ import annotations

from dataclasses import dataclass

from stack.types.geometry import FloatArray, Pose2D


@dataclass(frozen=True, slots=True)
class Frontier:
    """A place where known free space meets unknown space.

    Attributes:
        pose: from which the robot looks at it, map frame.
        middle: (x, y) of the frontier, metres, map frame.
        size: length, metres.
        gain: unknown area that a view from the pose can show, square metres.
        distance: of the way from the robot to the pose, metres.
    """

    pose: Pose2D
    middle: tuple[float, float]
    size: float
    gain: float
    distance: float


@dataclass(frozen=True, slots=True)
class CoveragePlan:
    """Lanes that cover an area.

    Attributes:
        lanes: start and end of each, with the heading along it, in the order of driving.
        points: (n, 2) centres of the free cells of the area, metres, map frame.
        resolution: side of a cell, metres.
        zones: names of the keep-out zones in the area; they are left out.
    """

    lanes: tuple[tuple[Pose2D, Pose2D], ...]
    points: FloatArray
    resolution: float
    zones: tuple[str, ...] = ()
