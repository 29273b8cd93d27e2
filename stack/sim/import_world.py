"""Read a world of any supported format: treepilot's own, Gazebo's, or a ROS map."""

from __future__ import annotations

from pathlib import Path

from stack.documents import read_file
from stack.mapping.pictures import is_image
from stack.sim.worlds.world import World
from stack.sim.worlds.world_file import read_world
from stack.types import Pose2D

GAZEBO = (".world", ".sdf")


def read_any_world(path: Path, start: Pose2D | None = None) -> World:
    """Read a world file and choose the format from its ending and content.

    `.world` and `.sdf` are Gazebo files; an image, or a YAML file with the key `image`,
    is a ROS map.

    Args:
        path: of the file.
        start: of the robot, which decides what the ground of a Gazebo world is; None: the
            origin, or the nearest free place.

    Raises:
        InputError: all findings, each with its position.
    """
    if path.suffix in GAZEBO:
        from stack.sim.sdf.world import read_sdf_world

        return read_sdf_world(path, start)
    if is_ros_map(path):
        from stack.sim.worlds.map_world import read_map_world

        return read_map_world(path)
    return read_world(path)


def is_ros_map(path: Path) -> bool:
    """Whether a file is a ROS map: an image, or YAML with the key `image` and no key `world`.

    Raises:
        InputError: the file cannot be read.
    """
    if is_image(path):
        return True
    top = read_file(path, "world file")
    return top.get("image") is not None and top.get("world") is None
