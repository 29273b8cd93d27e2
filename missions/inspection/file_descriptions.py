"""`treepilot describe` of robots, worlds, maps, missions and files of trees: by name, or a file."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import degrees
from pathlib import Path

from missions.execution.fit.arms import boxes_of
from missions.execution.prepare import RunOptions, prepare
from missions.execution.resources import catalogue_of, load_robot, load_world
from missions.inspection.declaration_tables import aligned
from missions.inspection.diagnosis import FileKind, file_kind
from missions.inspection.doctor.passages import counted
from missions.language.expressions.shown import shown
from missions.language.model import Mission
from missions.language.reading.trees import read_trees
from missions.language.reading.words import Draft
from robots.load import read_robot
from stack.documents import Findings, read_file, read_text, require_kind
from stack.documents.files import XML_BYTES, decoded, read_input, refuse_foreign
from stack.documents.foreign_kinds import BEGINNING
from stack.drivetrain.description import (
    CameraDescription,
    DepthCameraDescription,
    RobotDescription,
)
from stack.drivetrain.wheel_loop import NO_GAINS
from stack.errors import Finding, InputError, Mark
from stack.parameters import Declaration, declarations, values_of
from stack.sim.import_world import read_any_world
from stack.sim.worlds.world import World
from stack.types import CameraModel, Pose2D

CURRENT_FOLDER = Path()
SUFFIXES = (".yaml", ".yml", ".world", ".sdf")
SHOWN = 6
"""Values of an argument that is a list."""

DESCRIBED = "robot, world, map, mission or file of trees"

IN_FOLDERS = ("robot.yaml", "map.yaml")
"""Files by which a folder is known: that of a robot, and that of a saved map."""


def is_file_name(name: str) -> bool:
    """Return whether a name is that of a file or folder: with a slash, or a suffix of a file."""
    path = Path(name)
    return (
        "/" in name or name in (".", "..") or path.suffix in SUFFIXES
        or (bool(path.suffix) and path.is_file())
    )  # fmt: skip


def file_description(name: str) -> str:
    """Describe a file, or the robot or map in a folder.

    Raises:
        InputError: it cannot be read, has errors, or is of another kind.
    """
    path = _file_of(Path(name).expanduser())
    raw = read_input(path, "file", XML_BYTES)
    kind = file_kind(path, raw.decode("utf-8", errors="replace"))
    if kind is FileKind.ROBOT:
        return robot_description(read_robot(path))
    if kind in (FileKind.WORLD, FileKind.GAZEBO, FileKind.MAP):
        return world_description(read_any_world(path), doc_of(path, kind))
    if kind is FileKind.TREES:
        return _trees_description(path)
    if kind is FileKind.MISSION:
        return mission_description(path)
    refuse_foreign(raw[:BEGINNING], path, DESCRIBED)
    require_kind(read_text(decoded(raw, path), str(path), DESCRIBED), DESCRIBED)
    raise InputError([Finding(Mark(str(path)), "E007", f"not a {DESCRIBED}")])


def _file_of(path: Path) -> Path:
    if not path.is_dir():
        return path
    for name in IN_FOLDERS:
        if (path / name).is_file():
            return path / name
    sentence = f"the folder has neither {' nor '.join(IN_FOLDERS)}"
    raise InputError([Finding(Mark(str(path)), "E001", sentence, "name one of its files")])


def doc_of(file: Path, kind: FileKind = FileKind.OTHER) -> str:
    """Return the `doc` of a YAML file in one line; empty without one."""
    if kind in (FileKind.GAZEBO, FileKind.MAP):
        return ""
    doc = read_file(file).get("doc")
    return " ".join(str(doc.value).split()) if doc is not None else ""


def robot_summary(name: str) -> str:
    """Return size, drive and speeds of a robot in one line."""
    return robot_summary_of(load_robot(name, CURRENT_FOLDER))


def robot_summary_of(robot: RobotDescription) -> str:
    """Return size, drive and speeds of a robot in one line."""
    if not robot.drivetrain.moves:
        return f"radius {robot.footprint.circumscribed_radius:.2f} m, no wheels{_limbs(robot)}"
    limits, kind = robot.limits, robot.drivetrain.kind
    if robot.turning_radius:
        kind += f", turning radius {robot.turning_radius:.2f} m"
    return (
        f"radius {robot.footprint.circumscribed_radius:.2f} m, {kind}, {limits.linear_speed:g} m/s,"
        f" {limits.angular_speed:g} rad/s{_limbs(robot)}"
    )


def _limbs(robot: RobotDescription) -> str:
    """Return arm and gripper in words, after a comma; empty without an arm."""
    if robot.arm is None:
        return ""
    gripper = robot.arm.gripper
    width = "" if gripper is None else f", gripper {1e3 * gripper.width_max:.0f} mm"
    return f", arm with {counted(len(robot.arm.joints), 'joint')}{width}"


def robot_description(robot: RobotDescription) -> str:
    """Describe a robot: size, drive, sensors, limits, battery."""
    length, width = robot.footprint.points.max(axis=0) - robot.footprint.points.min(axis=0)
    lines = [f"{robot.name}: {robot_summary_of(robot)}"]
    lines.append(f"size: {length:.2f} m long, {width:.2f} m wide, {robot.height:.2f} m high")
    moves = robot.drivetrain.moves
    parts: dict[str, object] = {
        **({"limits": robot.limits, "lidar": robot.lidar} if moves else {}), **robot.lidars,
        **robot.sonars, "camera": robot.camera, **robot.depth_cameras, "imu": robot.imu,
        **({"odometry": robot.odometry} if moves else {}), "battery": robot.battery,
    }  # fmt: skip
    if robot.drivetrain.skids:
        parts["skid"] = robot.skid
    if robot.wheel_control != NO_GAINS:
        parts["wheel_control"] = robot.wheel_control
    for title, part in parts.items():
        if part is None:
            lines.append(f"{title}: none")
            continue
        values = values_of(part)
        lines.append(f"{title}:")
        lines += [
            f"  {item.name} = {_value_text(values[item.name])} {item.unit}".rstrip()
            + f"  ({item.help})"
            for item in _declared(part)
        ]
        if isinstance(part, CameraDescription | DepthCameraDescription):
            lines.append(f"  {_lens(part.model)}")
    return "\n".join([*lines, *_arm(robot)])


def _arm(robot: RobotDescription) -> list[str]:
    """Describe the joints and the postures of an arm; nothing without one."""
    arm = robot.arm
    if arm is None:
        return []
    ranges = zip(arm.joints, arm.limits.lower, arm.limits.upper, arm.limits.velocity, strict=True)
    lines = ["arm:"]
    lines += [
        f"  {name}: {low:.3g} to {high:.3g} rad, {speed:.3g} rad/s"
        for name, low, high, speed in ranges
    ]
    lines += [
        f"  posture {name}: [{', '.join(f'{value:.3g}' for value in positions)}]"
        for name, positions in arm.postures.items()
    ]
    lines.append(f"  poses are in the frame of {arm.base_link}, of {arm.tool_link}")
    return lines


def _declared(part: object) -> list[Declaration]:
    cls: type = type(part)
    return list(declarations(cls).values())


def _value_text(value: object) -> str:
    return f"{value:g}" if isinstance(value, int | float) else str(value)


def _lens(model: CameraModel) -> str:
    """Describe the intrinsics of a camera."""
    distortion = ", ".join(f"{value:g}" for value in model.distortion)
    return (
        f"{model.width} x {model.height} px, fx {model.fx:.2f}, fy {model.fy:.2f}, "
        f"cx {model.cx:.2f}, cy {model.cy:.2f} px, "
        + (f"distortion [{distortion}]" if model.is_distorted else "no distortion")
    )


def named_world_description(name: str, file: Path) -> str:
    """Describe a shipped world."""
    return world_description(load_world(name, CURRENT_FOLDER), doc_of(file))


def world_description(world: World, doc: str = "") -> str:
    """Describe a world: its size and what is in it."""
    x_min, y_min, x_max, y_max = world.bounds
    things = [
        counted(len(world.walls), "wall"), counted(len(world.boxes), "box", "boxes"),
        counted(len(world.blocks), "block"),
        counted(len(world.cylinders), "cylinder"), counted(len(world.docks), "dock"),
        counted(len(world.drops), "drop"), counted(len(world.lines), "line"),
        counted(len(world.friction_zones), "friction zone"),
        counted(len(world.posters), "poster"), counted(len(world.shadows), "shadow"),
    ]  # fmt: skip
    ignored = counted(len(world.warnings), "kind")
    rows = [
        ("size", f"{x_max - x_min:g} x {y_max - y_min:g} m, from ({x_min:g}, {y_min:g})"),
        ("has", ", ".join(text for text in things if not text.startswith("0 "))),
        ("boxes", ", ".join(boxes_of(world)) if any(box.name for box in world.boxes) else ""),
        ("blocks", ", ".join(block.name for block in world.blocks)),
        ("doors", ", ".join(door.name for door in world.doors)),
        ("people", ", ".join(person.name for person in world.people)),
        ("markers", ", ".join(str(marker.number) for marker in world.markers)),
        ("timeline", counted(len(world.timeline), "event") if world.timeline else ""),
        ("start", _pose(world.start)),
        ("ignored", f"{ignored} of elements, see `check`" if world.warnings else ""),
    ]
    lines = [f"{world.name}: {doc}" if doc else f"{world.name}:"]
    lines += [f"  {title:<9} {text}" for title, text in rows if text]
    return "\n".join([*lines, *_places(world.places)])


def mission_description(path: Path) -> str:
    """Describe a mission: what it does, robot, world, arguments, events and trees.

    Raises:
        InputError: it has errors.
    """
    plan = prepare(path, RunOptions())
    mission = plan.mission
    estimator = plan.choices["localisation"].name
    rows = [
        ("robot", f"{plan.robot.name}: {robot_summary_of(plan.robot)}"),
        ("plays", "" if mission.replay is None else str(mission.replay.log)),
        ("world", plan.world.name if mission.world else ""),
        ("map", mission.map),
        ("start", _pose(plan.start)),
        ("pose", f"estimated by {estimator}"),
        ("plugins", ", ".join(mission.plugins)),
        ("includes", ", ".join(file.name for file in mission.includes)),
        ("events", ", ".join(f"{event.name} ({event.then})" for event in mission.events)),
        ("tests", f"{len(mission.cases)} cases" if mission.cases else ""),
    ]
    lines = [f"{mission.name}: {_line(mission.doc)}" if mission.doc else f"{mission.name}:"]
    lines += [f"  {title:<9} {text}" for title, text in rows if text]
    parts = [aligned("arguments", _arguments(path, mission)), aligned("trees", _tree_rows(mission))]
    own = {name: pose for name, pose in mission.places.items() if name not in plan.world.places}
    shown = f"its tree: treepilot show {path}"
    return "\n".join([*lines, *filter(None, parts), *_places(own), shown])


def _arguments(path: Path, mission: Mission) -> list[tuple[str, ...]]:
    """Return name, value and what the file says of each argument."""
    declared = read_file(path, "mission").get("arguments")
    rows: list[tuple[str, ...]] = []
    for name, value in mission.arguments.items():
        node = None if declared is None else declared.get(name)
        kind, doc = (None if node is None else node.get(key) for key in ("type", "doc"))
        rows.append((
            name, f"= {shown(value, SHOWN)}", "" if kind is None else str(kind.value),
            "" if doc is None else _line(str(doc.value)),
        ))  # fmt: skip
    return rows


def _tree_rows(mission: Mission) -> list[tuple[str, str]]:
    return [(name, _line(tree.doc)) for name, tree in mission.trees.items()]


def _trees_description(path: Path) -> str:
    """Describe a file of trees and places for other missions."""
    read_trees(path, catalogue_of([], path.parent, Findings()), Draft())
    document = read_file(path)
    lines = [f"{path.name}: trees and places for missions that include it"]
    for key in ("trees", "places"):
        named = document.get(key)
        rows = []
        for name, node in () if named is None else named.entries:
            doc = node.get("doc") if key == "trees" else None
            rows.append((str(name.value), "" if doc is None else _line(str(doc.value))))
        lines += filter(None, [aligned(key, rows)])
    return "\n".join(lines)


def _places(places: Mapping[str, Pose2D]) -> Iterable[str]:
    if places:
        yield "places:"
    for name, pose in places.items():
        yield f"  {name:<12} {_pose(pose)}"


def _pose(pose: Pose2D) -> str:
    return f"[{pose.x:g}, {pose.y:g}, {degrees(pose.heading):.0f} deg]"


def _line(text: str) -> str:
    return " ".join(text.split())
