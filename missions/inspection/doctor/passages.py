"""`treepilot doctor`: the passages and places of a world or map that a robot can use."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import hypot, radians
from pathlib import Path

from behaviours.docking.dock import STAGING
from missions.execution.component_choices import all_chosen
from missions.execution.resources import WORLDS, load_robot
from stack.costmap.parameters import CostmapParameters
from stack.documents import Finding, Findings, Mark
from stack.drivetrain.description import RobotDescription
from stack.errors import InputError
from stack.geometry.polygons import widest_disc
from stack.mapping.passages import Passage, clearance_of, passages_of, widest_path_to, widest_paths
from stack.mapping.ros_map import read_ros_map
from stack.sim.import_world import GAZEBO, is_ros_map, read_any_world
from stack.sim.worlds.rasterise import map_problem, rasterise
from stack.sim.worlds.world import Dock
from stack.sim.worlds.world_file import find_world
from stack.types import FloatArray, OccupancyGrid, Pose2D

TIGHT_MARGIN = 0.10
"""Metres of margin below which a passage is reported as tight."""

AT_FACE, AT_FACE_HEADING = 0.05, radians(10.0)
"""Metres and radians from the face of a dock within which a place means the face."""


@dataclass(frozen=True)
class Examination:
    """Result of the diagnosis.

    Attributes:
        lines: text to print.
        closed: number of passages and places that the robot cannot use.
    """

    lines: tuple[str, ...]
    closed: int


CLOSED, TIGHT, OPEN = "✘", "!", "✔"
"""Verdicts on a passage or place, as printed."""

Verdict = tuple[str, str]
"""A verdict and a sentence."""


@dataclass(frozen=True)
class Place:
    """A map with its named poses."""

    name: str
    grid: OccupancyGrid
    places: dict[str, Pose2D]
    start: Pose2D | None
    docks: tuple[Dock, ...] = ()


def examine(
    name: str, robot_name: str, picture: Path | None, show: Callable[[str], None] = lambda _: None
) -> Examination:
    """Check which passages and places of a world or ROS map a robot can use.

    Args:
        name: name or file of a world, or a map.yaml.
        robot_name: name or file of a robot.
        picture: file for a picture of the result, or None.
        show: receives a line before each part that takes long.

    Raises:
        InputError: the world, map or robot cannot be read.
    """
    robot = load_robot(robot_name, Path.cwd())
    show(f"reading {name}")
    place = _read(name)
    rows, columns = place.grid.cells.shape
    show(f"passages of {columns} x {rows} cells")
    clearance = clearance_of(place.grid)
    passages = passages_of(place.grid, clearance)
    found = [_passage(passage, robot) for passage in passages]
    if place.places:
        show(f"ways to {counted(len(place.places), 'place')}")
    found += _place_verdicts(place, clearance, robot)
    verdicts = [verdict for verdict, _ in found]
    lines = [_head(place, robot), *(" ".join(each) for each in found)]
    lines.append(_result(verdicts, len(passages), len(place.places), robot))
    if picture is not None:
        from missions.inspection.doctor.picture import draw

        title = f"{place.name}, {robot.name} ({_needed(robot):.2f} m wide)"
        draw(picture, place.grid, clearance, passages, place.places, robot, title)
        lines.append(f"picture: {picture}")
    return Examination(tuple(lines), verdicts.count(CLOSED))


def _read(name: str) -> Place:
    file = find_world(name, Path(), WORLDS)  # findings name it as it was given
    if file.suffix not in GAZEBO and is_ros_map(file):
        return Place(file.stem, read_ros_map(file), {}, None)
    world = read_any_world(file)
    resolution = CostmapParameters().map_resolution  # of the costmaps
    problem = map_problem(world, resolution)
    if problem:
        hint = "set closer `bounds` in the world file"
        raise InputError([Finding(Mark(str(file)), "E413", problem, hint)])
    grid = rasterise(world, resolution)
    return Place(world.name, grid, dict(world.places), world.start, world.docks)


def _result(verdicts: list[str], passages: int, places: int, robot: RobotDescription) -> str:
    """Return the last line: whether the robot can go everywhere."""
    closed, tight = verdicts.count(CLOSED), verdicts.count(TIGHT)
    if closed:
        return (
            f"{counted(closed, 'passage or place', 'passages and places')} closed to {robot.name}"
        )
    found = f"{counted(passages, 'passage')} and {counted(places, 'place')}"
    if tight:
        return f"no obstruction: {robot.name} can use {found}; {tight} with little room"
    return f"clean: {robot.name} can use {found} without difficulty"


def counted(number: int, one: str, more: str = "") -> str:
    """Return a number with its noun: `1 place`, `3 places`."""
    return f"{number} {one if number == 1 else more or f'{one}s'}"


def show_world(name: str, picture: Path) -> str:
    """Draw a world or ROS map with its places; return a line about it.

    Raises:
        InputError: the world cannot be read, or the picture cannot be written.
    """
    from missions.map_picture import draw_world

    place = _read(name)
    size = _size(place.grid)
    draw_world(picture, place.grid, place.places, f"{place.name}, {size}")
    return f"wrote {picture}: {place.name}, {size}, {counted(len(place.places), 'place')}"


def _size(grid: OccupancyGrid) -> str:
    rows, columns = grid.cells.shape
    return f"{columns * grid.resolution:.1f} x {rows * grid.resolution:.1f} m"


def _head(place: Place, robot: RobotDescription) -> str:
    return (
        f"{place.name}: {_size(place.grid)} at {place.grid.resolution * 100:g} cm;"
        f" {robot.name} is {_needed(robot):.2f} m wide"
        f" ({2 * robot.footprint.circumscribed_radius:.2f} m across its corners)"
    )


def _needed(robot: RobotDescription) -> float:
    return robot.footprint.width


def _passage(passage: Passage, robot: RobotDescription) -> Verdict:
    where = f"passage at ({passage.x:.2f}, {passage.y:.2f}), {passage.width:.2f} m wide"
    needed, corners = _needed(robot), 2.0 * robot.footprint.circumscribed_radius
    if passage.width < needed:
        return CLOSED, f"{where}: closed; the footprint needs {needed:.2f} m"
    if passage.width < corners:
        return TIGHT, f"{where}: open, but turning in place needs {corners:.2f} m"
    margin = passage.width - needed
    if margin < TIGHT_MARGIN:
        return TIGHT, f"{where}: open with a margin of {margin * 100:.0f} cm"
    costs = all_chosen(robot, {}, Findings())["costmap"].parameters
    if passage.width / 2.0 < costs.inflation_radius:
        why = f"walls are within inflation_radius {costs.inflation_radius:g} m"
        return OPEN, f"{where}: open; {why}, so paths avoid it if possible"
    return OPEN, f"{where}: open"


def is_face(dock: Dock, pose: Pose2D) -> bool:
    """Tell whether a place is what the behaviour `dock` is given: the face and its direction."""
    if dock.facing is None:
        return False
    offset = pose.relative_to(Pose2D(dock.x, dock.y, dock.facing))
    return hypot(offset.x, offset.y) <= AT_FACE and abs(offset.heading) <= AT_FACE_HEADING


def _place_verdicts(
    place: Place, clearance: FloatArray, robot: RobotDescription
) -> Iterator[Verdict]:
    if place.start is None or not place.places:
        return
    x, y, radius = widest_disc(robot.footprint.points)
    disc = Pose2D(x, y)
    begin = place.start.compose(disc)
    widest = widest_paths(place.grid, clearance, (begin.x, begin.y))
    needed = 2.0 * radius
    for name, pose in place.places.items():
        where = f"place {name} ({pose.x:.2f}, {pose.y:.2f})"
        if any(is_face(dock, pose) for dock in place.docks):
            where += f", {STAGING:g} m before the face of the dock"
            pose = pose.compose(Pose2D(robot.footprint.front + STAGING, 0.0))
        middle = pose.compose(disc)
        row, column = place.grid.cell_at(middle.x, middle.y)
        inside = place.grid.contains(row, column)
        free = 2.0 * float(clearance[row, column]) if inside else 0.0
        route = widest_path_to(place.grid, widest, middle.x, middle.y)
        if not inside:
            yield CLOSED, f"{where}: outside the map"
        elif free < needed:
            yield CLOSED, f"{where}: blocked; {free:.2f} m free, the footprint needs {needed:.2f} m"
        elif route.width < needed:
            least = f"the widest route is {route.width:.2f} m at ({route.x:.2f}, {route.y:.2f})"
            yield CLOSED, f"{where}: not reachable; {least}, the footprint needs {needed:.2f} m"
        else:
            least = f"narrowest point {route.width:.2f} m at ({route.x:.2f}, {route.y:.2f})"
            yield OPEN, f"{where}: reachable; {least}"
