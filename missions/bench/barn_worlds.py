"""The worlds of a BARN run: Gazebo files, or the benchmark's cylinder grids as JSON."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from stack.description import RobotDescription
from stack.documents import Finding, Mark
from stack.errors import InputError
from stack.sim.world import Cylinder, World
from stack.types import Pose2D

CYLINDER_HEIGHT = 1.0
ROOM = 1.0
"""Metres of floor round start and goal."""

GRID_CORNER, GRID_PITCH = (-4.425, 0.075), 0.15
"""Metres: centre of the grid's cell (0, 0) in Gazebo's frame, and from cell to cell."""


@dataclass(frozen=True, slots=True)
class BarnWorld:
    """A world to cross.

    Attributes:
        name: `17`, or the stem of its file.
        path_length: metres of the way that the metric calls optimal; None where not known.
    """

    name: str
    world: World
    path_length: float | None = None


def find_worlds(path: Path) -> list[BarnWorld]:
    """The worlds in a folder of .world and .sdf files, in one such file, or in a JSON of grids.

    Raises:
        InputError: there are none, or one of them cannot be read.
    """
    if path.suffix == ".json":
        return read_grids(path)
    files = [path]
    if path.is_dir():
        found = {file for ending in ("world", "sdf") for file in path.glob(f"*.{ending}")}
        files = sorted(found, key=lambda file: _natural(file.stem))
    if not files or not path.exists():
        raise _refused(path, "no BARN worlds here; expected .world files, one of them, or a .json")
    from missions.resources import load_world

    return [BarnWorld(file.stem, load_world(str(file.resolve()), file.parent)) for file in files]


def read_grids(path: Path) -> list[BarnWorld]:
    """The worlds of a JSON file: {"radius", "worlds": [{"id", "path_len", "cyl": [[ix, iy]…]}…]}.

    Raises:
        InputError: no such file, not JSON, or not of this form.
    """
    try:
        content = json.loads(path.read_text("utf-8"))
        return [_grid_world(entry, float(content["radius"]), path) for entry in content["worlds"]]
    except OSError as error:
        raise _refused(path, f"cannot be read: {error.strerror}") from None
    except json.JSONDecodeError as error:
        finding = Finding(Mark(str(path), error.lineno, error.colno), "E004", "not JSON", error.msg)
        raise InputError([finding]) from None
    except (KeyError, TypeError, ValueError) as error:
        raise _refused(path, f"not a file of BARN grids: {type(error).__name__} {error}") from None


def _grid_world(entry: dict[str, Any], radius: float, path: Path) -> BarnWorld:
    name = str(entry["id"])
    cylinders = tuple(
        Cylinder(
            GRID_CORNER[0] + GRID_PITCH * column, GRID_CORNER[1] + GRID_PITCH * row,
            radius, CYLINDER_HEIGHT,
        )
        for column, row in entry["cyl"]
    )  # fmt: skip
    xs, ys = [item.x for item in cylinders], [item.y for item in cylinders]
    world = World(
        name=f"BARN {name}",
        bounds=(min(xs) - 1.0, min(ys) - 1.0, max(xs) + 1.0, max(ys) + 5.0),
        cylinders=cylinders,
        start=Pose2D(-2.25, 3.0),
        source=path,
    )
    return BarnWorld(name, world, float(entry["path_len"]))


def path_length(case: BarnWorld, robot: RobotDescription, start: Pose2D, goal: Pose2D) -> float:
    """Metres of the way that the metric calls optimal.

    The benchmark's own where the case has one; else that of the shortest way on the true map for
    a disc of the robot's inscribed radius.

    Args:
        case: a world.
        robot: who crosses it.
        start: world frame.
        goal: world frame.

    Raises:
        NavigationError: there is no way.
    """
    if case.path_length is not None:
        return case.path_length
    from stack.costmap.costmap import Costmap
    from stack.costmap.parameters import CostmapParameters
    from stack.planning.astar import Astar, AstarParameters
    from stack.sim.rasterise import rasterise

    x_min, y_min, x_max, y_max = case.world.bounds
    bounds = (
        min(x_min, start.x - ROOM, goal.x - ROOM), min(y_min, start.y - ROOM, goal.y - ROOM),
        max(x_max, start.x + ROOM, goal.x + ROOM), max(y_max, start.y + ROOM, goal.y + ROOM),
    )  # fmt: skip
    grid = rasterise(replace(case.world, bounds=bounds, start=start))
    radius = robot.footprint.inscribed_radius
    costs = Costmap(CostmapParameters(inflation_radius=radius), robot.footprint, grid)
    return Astar(AstarParameters(cost_weight=0.0), robot).plan(costs.grid, start, goal).length


def _natural(stem: str) -> tuple[str, int]:
    """Sorts world_2 before world_10."""
    head = stem.rstrip("0123456789")
    tail = stem[len(head) :]
    return head, int(tail or -1)


def _refused(path: Path, sentence: str) -> InputError:
    return InputError([Finding(Mark(str(path)), "E001", sentence)])
