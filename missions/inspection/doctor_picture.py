"""Picture of passages and places: `treepilot doctor --png`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from stack.drivetrain.description import RobotDescription
from stack.errors import InputError
from stack.mapping.passages import Passage
from stack.types import FloatArray, OccupancyGrid, Pose2D

PIXELS_PER_METRE = 120
"""Approximate scale; a cell is a whole number of pixels."""

GROUND, WALL, CLOSED, TIGHT = (34, 21, 13), (193, 165, 147), (90, 60, 140), (70, 90, 150)
GOOD, BAD, TEXT = (151, 220, 61), (107, 107, 255), (234, 214, 201)
"""Colours: blue, green, red."""


def draw(  # noqa: PLR0913 - one call from one place
    path: Path, grid: OccupancyGrid, clearance: FloatArray, passages: Sequence[Passage],
    places: Mapping[str, Pose2D], robot: RobotDescription,
) -> None:  # fmt: skip
    """Draw the map with passages and places; purple cells are closed to the robot's centre.

    Args:
        path: file to write, .png.
        grid: the map, world frame.
        clearance: distance of each cell to the nearest obstacle, metres, shape of the grid.
        passages: passages to mark, green where the robot fits, else red.
        places: named poses to mark, world frame.
        robot: the robot whose footprint counts.

    Raises:
        InputError: the picture cannot be written.
    """
    import cv2

    image = np.full((*grid.cells.shape, 3), 10, dtype=np.uint8)
    free = grid.free
    image[free] = GROUND
    image[free & (clearance < robot.footprint.circumscribed_radius)] = TIGHT
    image[free & (clearance < robot.footprint.inscribed_radius)] = CLOSED
    image[grid.occupied] = WALL
    scale = max(1, round(PIXELS_PER_METRE * grid.resolution))
    image = cv2.resize(np.flipud(image), None, fx=scale, fy=scale, interpolation=cv2.INTER_NEAREST)

    def pixel(x: float, y: float) -> tuple[int, int]:
        column = (x - grid.origin[0]) / grid.resolution
        row = grid.cells.shape[0] - (y - grid.origin[1]) / grid.resolution
        return round(column * scale), round(row * scale)

    needed = 2.0 * robot.footprint.inscribed_radius
    for passage in passages:
        colour = GOOD if passage.width >= needed else BAD
        radius = max(4, round(passage.width / 2 / grid.resolution * scale))
        cv2.circle(image, pixel(passage.x, passage.y), radius, colour, 2, cv2.LINE_AA)
        _write(image, pixel(passage.x, passage.y), f"{passage.width:.2f}", colour)
    for name, pose in places.items():
        cv2.drawMarker(image, pixel(pose.x, pose.y), TEXT, cv2.MARKER_CROSS, 12, 2)
        _write(image, pixel(pose.x, pose.y), name, TEXT)
    if not cv2.imwrite(str(path), image):
        raise InputError(f"cannot write the picture {path}; the name must end in .png")


def _write(image: object, at: tuple[int, int], text: str, colour: tuple[int, int, int]) -> None:
    import cv2

    place = (at[0] + 8, at[1] - 6)
    cv2.putText(image, text, place, cv2.FONT_HERSHEY_SIMPLEX, 0.5, colour, 1, cv2.LINE_AA)  # type: ignore[call-overload]
