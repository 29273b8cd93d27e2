"""Worlds of the BARN benchmark: Gazebo files, or its cylinder grids as JSON."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from missions.bench.goal_runs import Case
from stack.documents import Finding, Mark
from stack.documents.files import JSON_BYTES, read_bytes
from stack.errors import InputError
from stack.sim.worlds.world import Cylinder, World
from stack.types import Pose2D

CYLINDER_HEIGHT = 1.0

GRID_CORNER, GRID_PITCH = (-4.425, 0.075), 0.15
"""Centre of the grid's cell (0, 0) in Gazebo's frame, and distance between cells, metres."""


def find_worlds(path: Path) -> list[Case]:
    """Read the worlds of a folder of .world and .sdf files, of one such file, or of a JSON file.

    Raises:
        InputError: there are no worlds, or one of them cannot be read.
    """
    if path.suffix == ".json":
        return read_grids(path)
    files = [path]
    if path.is_dir():
        found = {file for ending in ("world", "sdf") for file in path.glob(f"*.{ending}")}
        files = sorted(found, key=lambda file: _sort_key(file.stem))
    if not files or not path.exists():
        raise _error(path, "no BARN worlds; expected a folder of .world files, one file or a .json")
    from missions.execution.resources import load_world

    return [Case(file.stem, load_world(str(file.resolve()), file.parent)) for file in files]


def read_grids(path: Path) -> list[Case]:
    """Read a JSON file: {"radius", "worlds": [{"id", "path_len", "cyl": [[ix, iy]…]}…]}.

    Raises:
        InputError: the file is missing, is not JSON, or has another structure.
    """
    try:
        content = json.loads(read_bytes(path, JSON_BYTES))
        return [_grid_world(entry, float(content["radius"]), path) for entry in content["worlds"]]
    except OSError as error:
        raise _error(path, f"cannot be read: {error.strerror}") from None
    except json.JSONDecodeError as error:
        finding = Finding(Mark(str(path), error.lineno, error.colno), "E004", "not JSON", error.msg)
        raise InputError([finding]) from None
    except (KeyError, TypeError, ValueError) as error:
        raise _error(path, f"not a file of BARN grids: {type(error).__name__} {error}") from None


def _grid_world(entry: dict[str, Any], radius: float, path: Path) -> Case:
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
    return Case(name, world, path_length=float(entry["path_len"]))


def _sort_key(stem: str) -> tuple[str, int]:
    """Return a key that sorts world_2 before world_10."""
    head = stem.rstrip("0123456789")
    tail = stem[len(head) :]
    return head, int(tail or -1)


def _error(path: Path, sentence: str) -> InputError:
    return InputError([Finding(Mark(str(path)), "E001", sentence)])
