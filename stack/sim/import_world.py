"""Worlds of every kind that can be read: ours, Gazebo's, and ROS maps as walls."""

from __future__ import annotations

from pathlib import Path

from stack.documents import read_file
from stack.sim.worlds.world import World
from stack.sim.worlds.world_file import read_world

GAZEBO = (".world", ".sdf")


def read_any_world(path: Path) -> World:
    """The world in a file: .world and .sdf are Gazebo's, a YAML with `image` is a ROS map.

    Raises:
        InputError: every finding, each with its position.
    """
    if path.suffix in GAZEBO:
        from stack.sim.sdf.world import read_sdf_world

        return read_sdf_world(path)
    if is_ros_map(path):
        from stack.sim.worlds.map_world import read_map_world

        return read_map_world(path)
    return read_world(path)


def is_ros_map(path: Path) -> bool:
    """Whether a YAML file names a picture and no world.

    Raises:
        InputError: it cannot be read.
    """
    top = read_file(path, "world file")
    return top.get("image") is not None and top.get("world") is None
