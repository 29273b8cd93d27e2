"""Picture of passages and places: `treepilot doctor --png`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from missions.map_picture import Colour, MapPicture
from stack.drivetrain.description import RobotDescription
from stack.mapping.passages import Passage
from stack.types import FloatArray, OccupancyGrid, Pose2D

CLOSED: Colour = (90, 60, 140)
TIGHT: Colour = (70, 90, 150)
GOOD: Colour = (151, 220, 61)
BAD: Colour = (107, 107, 255)
"""Colours: blue, green, red."""


def draw(  # noqa: PLR0913 - one call from one place
    path: Path, grid: OccupancyGrid, clearance: FloatArray, passages: Sequence[Passage],
    places: Mapping[str, Pose2D], robot: RobotDescription, title: str,
) -> None:  # fmt: skip
    """Draw the map with passages and places; purple cells are closed to the robot's centre.

    Args:
        path: file to write, .png.
        grid: the map, world frame.
        clearance: distance of each cell to the nearest obstacle, metres, shape of the grid.
        passages: passages to mark, green where the robot fits, else red.
        places: named poses to mark, world frame.
        robot: the robot whose footprint counts.
        title: text below the map.

    Raises:
        InputError: the picture cannot be written.
    """
    picture, free = MapPicture(grid), grid.free
    picture.fill(free & (clearance < robot.footprint.circumscribed_radius), TIGHT)
    picture.fill(free & (clearance < robot.footprint.inscribed_radius), CLOSED)
    picture.begin()
    needed = 2.0 * robot.footprint.inscribed_radius
    for passage in passages:
        colour = GOOD if passage.width >= needed else BAD
        picture.circle(passage.x, passage.y, passage.width / 2.0, colour)
        picture.label(f"{passage.width:.2f} m", passage.x, passage.y, colour)
    for name, pose in places.items():
        picture.place(name, pose)
    picture.save(path, title)
