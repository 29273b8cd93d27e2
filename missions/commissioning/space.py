"""Free space around a robot, and the patterns that fit into it."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, pi, sin

import numpy as np

from missions.commissioning.driver import MARGIN
from stack.drivetrain.description import RobotDescription
from stack.errors import InputError
from stack.types import FloatArray

SMALLEST, LARGEST, STEP = 1.0, 3.0, 0.25
"""Sides of the square that is driven, metres."""

CLEARANCE = 0.15
"""Metres between the outline and the nearest obstacle on a pattern, besides MARGIN."""

ROTATIONS = 12
"""Directions that are tried, over a quarter of a turn."""

CIRCLE = 1.15
"""Radius of a car's circles as a share of its turning radius."""


@dataclass(frozen=True, slots=True)
class Pattern:
    """The place for a pattern, centred on the robot as it stands.

    Attributes:
        direction: of its x axis, base frame at the start, radians.
        side: of the square, metres; of a car the radius of its circles.
    """

    direction: float
    side: float


def needed(robot: RobotDescription) -> str:
    """Return the space that the smallest pattern needs, for people."""
    x, y = _half_extent(robot, _smallest(robot))
    return f"{2 * x:.1f} x {2 * y:.1f} m"


def pattern_in(points: FloatArray, robot: RobotDescription) -> Pattern:
    """Return the largest pattern that fits around the robot.

    Args:
        points: (n, 2) what its lidar sees, base frame, metres.
        robot: its description.

    Raises:
        InputError: none fits; the message says what is needed and what is in the way.
    """
    sides = [_smallest(robot)]
    if robot.drivetrain.turns_in_place:
        sides = np.arange(LARGEST, SMALLEST - 1e-9, -STEP).tolist()
    rotations = ROTATIONS if robot.drivetrain.turns_in_place else 1  # a car begins straight on
    for side in sides:
        for rotation in range(rotations):
            direction = rotation * pi / 2.0 / ROTATIONS
            if _is_free(points, _half_extent(robot, side), direction):
                return Pattern(direction, side)
    distances = np.hypot(points[:, 0], points[:, 1])
    nearest = int(distances.argmin())
    angle = float(np.degrees(np.arctan2(points[nearest, 1], points[nearest, 0])))
    raise InputError(
        f"{robot.name} needs a free area of {needed(robot)} around it; the nearest thing is "
        f"{distances[nearest]:.2f} m from its base at {angle:.0f} deg",
        "place it in the middle of a free area, with walls or furniture within the lidar's range",
    )


def _smallest(robot: RobotDescription) -> float:
    return SMALLEST if robot.drivetrain.turns_in_place else CIRCLE * robot.turning_radius


def _half_extent(robot: RobotDescription, side: float) -> tuple[float, float]:
    """Return the half lengths of the free area along x and y of the pattern, metres."""
    edge = robot.footprint.circumscribed_radius + MARGIN + CLEARANCE
    if robot.drivetrain.turns_in_place:
        return side / 2.0 + edge, side / 2.0 + edge
    return side + edge, 2.0 * side + edge


def _is_free(points: FloatArray, half: tuple[float, float], direction: float) -> bool:
    c, s = cos(direction), sin(direction)
    along = np.abs(c * points[:, 0] + s * points[:, 1])
    across = np.abs(c * points[:, 1] - s * points[:, 0])
    return not bool(((along < half[0]) & (across < half[1])).any())
