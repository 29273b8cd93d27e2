"""Writes a grid as a map.yaml and a map.pgm for tests that read maps."""

from pathlib import Path

from stack.mapping.ros_map import map_files
from stack.types import OccupancyGrid


def write_ros_map(grid: OccupancyGrid, path: Path) -> None:
    for name, content in map_files(grid, path.name, path.with_suffix(".pgm").name).items():
        (path.parent / name).write_bytes(content)
