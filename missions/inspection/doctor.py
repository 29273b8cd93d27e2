"""`treepilot doctor`: what of a place a robot can use, and which parameter closes the rest."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from missions.execution.component_choices import all_chosen
from missions.execution.resources import WORLDS, load_robot
from stack.costmap.parameters import CostmapParameters
from stack.documents import read_file
from stack.drivetrain.description import RobotDescription
from stack.mapping.passages import Passage, clearance_of, passages_of, widest_path_to, widest_paths
from stack.mapping.ros_map import read_ros_map
from stack.sim.worlds.rasterise import rasterise
from stack.sim.worlds.world_file import find_world, read_world
from stack.types import FloatArray, OccupancyGrid, Pose2D

SNUG = 0.10
"""Metres of room to spare below which a passage is called tight."""


@dataclass(frozen=True)
class Diagnosis:
    """What was found.

    Attributes:
        lines: sentences for people.
        closed: how many passages and places the robot cannot use.
    """

    lines: tuple[str, ...]
    closed: int


@dataclass(frozen=True)
class Place:
    """A map with its named poses."""

    name: str
    grid: OccupancyGrid
    places: dict[str, Pose2D]
    start: Pose2D | None


def diagnose(name: str, robot_name: str, picture: Path | None) -> Diagnosis:
    """Look at a world or a ROS map with the eyes of a robot.

    Args:
        name: a world's name or file, or a map.yaml.
        robot_name: a robot's name or file.
        picture: where to draw what was found, or None.

    Raises:
        InputError: the place or the robot cannot be read.
    """
    place = _read(name)
    robot = load_robot(robot_name, Path.cwd())
    clearance = clearance_of(place.grid)
    passages = passages_of(place.grid, clearance)
    lines, closed = list(_head(place, robot)), 0
    for passage in passages:
        sentence, shut = _passage_line(passage, robot)
        lines.append(sentence)
        closed += shut
    for sentence, shut in _place_lines(place, clearance, robot):
        lines.append(sentence)
        closed += shut
    if picture is not None:
        from missions.inspection.doctor_picture import draw

        draw(picture, place.grid, clearance, passages, place.places, robot)
        lines.append(f"picture: {picture}")
    return Diagnosis(tuple(lines), closed)


def _read(name: str) -> Place:
    path = Path(name)
    if path.is_file() and "image" in [key.value for key, _ in read_file(path, "map").entries]:
        return Place(path.stem, read_ros_map(path), {}, None)
    world = read_world(find_world(name, Path.cwd(), WORLDS))
    grid = rasterise(world, CostmapParameters().map_resolution)  # as the costmaps have it
    return Place(world.name, grid, dict(world.places), world.start)


def _head(place: Place, robot: RobotDescription) -> Iterator[str]:
    rows, columns = place.grid.cells.shape
    side = place.grid.resolution
    yield (
        f"{place.name}: {columns * side:.1f} x {rows * side:.1f} m at {side * 100:g} cm;"
        f" {robot.name} is {_needed(robot):.2f} m wide"
        f" ({2 * robot.footprint.circumscribed_radius:.2f} m corner to corner)"
    )


def _needed(robot: RobotDescription) -> float:
    return 2.0 * robot.footprint.inscribed_radius


def _passage_line(passage: Passage, robot: RobotDescription) -> tuple[str, bool]:
    where = f"passage at ({passage.x:.2f}, {passage.y:.2f}), {passage.width:.2f} m wide"
    needed, corners = _needed(robot), 2.0 * robot.footprint.circumscribed_radius
    if passage.width < needed:
        return f"✘ {where}: closed; the footprint needs {needed:.2f} m", True
    if passage.width < corners:
        return f"! {where}: open, but too narrow to turn in (footprint, {corners:.2f} m)", False
    spare = passage.width - needed
    if spare < SNUG:
        return f"! {where}: open with {spare * 100:.0f} cm to spare", False
    costs = all_chosen(robot, {})["costmap"].parameters
    if passage.width / 2.0 < costs.inflation_radius:
        why = f"inside inflation_radius {costs.inflation_radius:g} m, so paths avoid it if they can"
        return f"✔ {where}: open; {why}", False
    return f"✔ {where}: open", False


def _place_lines(
    place: Place, clearance: FloatArray, robot: RobotDescription
) -> Iterator[tuple[str, bool]]:
    if place.start is None:
        return
    ways = widest_paths(place.grid, clearance, (place.start.x, place.start.y))
    needed = _needed(robot)
    for name, pose in place.places.items():
        where = f"place {name} ({pose.x:.2f}, {pose.y:.2f})"
        row, column = place.grid.cell_at(pose.x, pose.y)
        inside = place.grid.contains(row, column)
        free = 2.0 * float(clearance[row, column]) if inside else 0.0
        way = widest_path_to(place.grid, ways, pose.x, pose.y)
        if not inside:
            yield f"✘ {where}: outside the map", True
        elif free < needed:
            yield f"✘ {where}: blocked; {free:.2f} m of room, footprint needs {needed:.2f} m", True
        elif way.width < needed:
            least = f"the widest way is {way.width:.2f} m at ({way.x:.2f}, {way.y:.2f})"
            yield f"✘ {where}: not reachable; {least}, footprint needs {needed:.2f} m", True
        else:
            least = f"narrowest point {way.width:.2f} m at ({way.x:.2f}, {way.y:.2f})"
            yield f"✔ {where}: reachable; {least}", False
