"""What the results of a bench depend on, besides worlds and seeds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, fields, is_dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from missions.execution.prepare import PreparedMission, RunOptions
from missions.execution.resources import load_map, map_folder
from stack.drivetrain.description import RobotDescription


def conditions(plan: PreparedMission, options: RunOptions) -> dict[str, Any]:
    """Return mission, arguments, robot and parameters of a run, to be kept with the results.

    Files are kept as digests of their contents: results do not depend on where they are.
    """
    chosen = {
        kind: {
            "use": choice.name, "parts": _contents(choice.parts), **_contents(choice.parameters),
        }
        for kind, choice in plan.choices.items()
    }  # fmt: skip
    return {
        "files": [digest(file.read_bytes()) for file in plan.files],
        "map": _map_of(plan), "arguments": dict(options.arguments or {}),
        "robot": plan.robot.name, "robot file": _content_of(plan.robot),
        "limits": asdict(plan.robot.limits), "navigation": chosen,
    }  # fmt: skip


def _contents(value: Any) -> Any:
    """Return settings as JSON has them, with the digests of the files that they name."""
    if is_dataclass(value) and not isinstance(value, type):
        return {item.name: _contents(getattr(value, item.name)) for item in fields(value)}
    if isinstance(value, Mapping):
        return {str(key): _contents(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_contents(item) for item in value]
    if isinstance(value, str | Path):
        file = Path(value)
        named = file.is_absolute() and file.is_file()
        return digest(file.read_bytes()) if named else str(value)
    return value if isinstance(value, bool | int | float | None) else str(value)


def _content_of(robot: RobotDescription) -> str:
    """Return robot.yaml, the URDF as the simulation loads it, and its meshes as one digest."""
    model = ElementTree.fromstring(robot.model)
    for mesh in model.iter("mesh"):
        mesh.set("filename", digest(Path(mesh.attrib["filename"]).read_bytes()))
    text = b"" if robot.source is None else robot.source.read_bytes()
    return digest(text + ElementTree.tostring(model))


def _map_of(plan: PreparedMission) -> str:
    """Return the cells of a map file as a digest; `from_world` and `none` as they are."""
    name, folder = plan.mission.map, plan.mission.source.parent
    if map_folder(name, folder) is None:
        return name
    grid = load_map(name, folder)
    return digest(repr((grid.resolution, grid.origin)).encode() + grid.cells.tobytes())


def world_of(plan: PreparedMission) -> str:
    """Return the content of a mission's world as a digest; the name of one without a file."""
    source = plan.world.source
    return plan.world.name if source is None else digest(source.read_bytes())


def digest(content: bytes) -> str:
    """Return a short digest of a content."""
    return sha256(content).hexdigest()[:16]
