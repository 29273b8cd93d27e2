"""`treepilot new mission`, `new world` and `new robot`: commented files that run."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from string import Template

from behaviours.scaffold import write_new
from missions.execution.resources import WORLDS, load_robot, mission_files, world_files
from robots.load import robot_names
from robots.proposal.robot_file import RobotProposal, propose_robot
from robots.urdf.reading import UrdfSource
from stack.errors import InputError
from stack.sim.import_world import read_any_world
from stack.sim.worlds.world import World
from stack.sim.worlds.world_file import find_world
from stack.types import Pose2D

TEMPLATES = Path(__file__).parent / "templates"
MOST_GOALS = 3


class FileTemplate(Template):
    """A template with @name for each placeholder: `$name` belongs to the mission language."""

    delimiter = "@"


def new_mission(name: str, folder: Path, world: str, robot: str) -> Path:
    """Write `<name>.yaml`, a mission that visits places of a world, or moves a standing arm.

    Args:
        name: of the file, without its ending.
        folder: for the file; must exist.
        world: name or path; a path is relative to the current folder.
        robot: as `world`.

    Raises:
        InputError: the name is invalid or taken, or the world or the robot cannot be read.
    """
    check_file_name(name, "mission", [file.stem for file in mission_files()])
    found = read_any_world(find_world(world, Path.cwd(), WORLDS))
    described = load_robot(robot, Path.cwd())
    if described.arm is not None and not described.drivetrain.moves:
        postures = [f"    - move_arm: {{posture: {key}}}" for key in described.arm.postures]
        words = {"postures": "\n".join(postures)}
        words |= {"world": _from(world, folder), "robot": _from(robot, folder)}
        return _write("arm_mission", name, folder, words)
    goals = _goals(found)
    indent = " " * 2
    listed = [f"{indent}{key}: {_pose(pose)}" for key, pose in goals.items()]
    if not found.places:
        listed.append(f"{indent}# names of places in the world can be used too; this one has none")
    words = {
        "places": "\n".join(listed), "goals": ", ".join(f"${key}" for key in goals),
        "world": _from(world, folder), "robot": _from(robot, folder),
    }  # fmt: skip
    return _write("mission", name, folder, words)


def new_world(name: str, folder: Path) -> Path:
    """Write `<name>.yaml`, a world of two rooms.

    Raises:
        InputError: the name is invalid or taken.
    """
    check_file_name(name, "world", [file.stem for file in world_files()])
    return _write("world", name, folder, {"path": f"./{folder / f'{name}.yaml'}"})


def new_robot(
    name: str, folder: Path, urdf: Path, packages: Sequence[str], arguments: Mapping[str, str]
) -> tuple[Path, RobotProposal]:
    """Write `robot.yaml`, a proposal for a URDF.

    Args:
        name: of the robot; empty: that of the URDF.
        folder: for the file.
        urdf: URDF or xacro file, relative to the current folder.
        packages: folders in which its packages are searched for, relative to the current folder.
        arguments: of a xacro file.

    Raises:
        InputError: the URDF has errors, no kind of drive fits it, or there is such a file.
    """
    if name:
        check_file_name(name, "robot", robot_names())
    path = os.path.relpath(urdf, folder)
    value: dict[str, object] = {"file": path}
    if packages:
        value["packages"] = [os.path.relpath(package, folder) for package in packages]
    if arguments:
        value["arguments"] = dict(arguments)
    # JSON is YAML as well, whatever the texts contain.
    written_value = json.dumps(value if len(value) > 1 else path, ensure_ascii=False)
    source = UrdfSource(urdf, tuple(map(Path, packages)), arguments)
    proposal = propose_robot(source, name, written_value)
    (written,) = write_new({folder / "robot.yaml": proposal.text})
    return written, proposal


def check_file_name(name: str, what: str, shipped: list[str]) -> None:
    """Raise InputError if a file cannot have this name."""
    if not re.fullmatch(r"[a-z0-9][a-z0-9_-]{0,60}", name):
        raise InputError(
            f"{name!r} cannot name a {what}: use lower-case letters, digits, _ and -, without"
            " .yaml, e.g. night_patrol"
        )
    if name in shipped:
        raise InputError(f"{name!r} is the name of a shipped {what}; choose another one")


def _goals(world: World) -> dict[str, Pose2D]:
    """Return places of the world under names of the mission, away from the start if possible."""
    away = [pose for pose in world.places.values() if pose.distance_to(world.start) > 0.5]
    chosen = away[:MOST_GOALS] or [world.start]
    return {f"goal_{number}": pose for number, pose in enumerate(chosen, 1)}


def _pose(pose: Pose2D) -> str:
    degrees = round(pose.heading * 57.29577951308232, 1)
    return f"[{pose.x:g}, {pose.y:g}, {degrees:g} deg]"


def _from(name: str, folder: Path) -> str:
    """Return a name, or a path relative to the folder of the new file."""
    if "/" not in name and not Path(name).suffix:
        return name
    target, base = Path(name).expanduser().resolve(), folder.resolve()
    return f"./{target.relative_to(base)}" if target.is_relative_to(base) else str(target)


def _write(kind: str, name: str, folder: Path, words: Mapping[str, str]) -> Path:
    file = folder / f"{name}.yaml"
    text = FileTemplate((TEMPLATES / f"{kind}.yaml.template").read_text("utf-8")).substitute(
        name=name, title=name.replace("_", " ").replace("-", " "), file=file, **words
    )
    (written,) = write_new({file: text})
    return written
