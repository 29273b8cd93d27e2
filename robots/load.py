"""Reader of robot.yaml and the URDF next to it; reports all findings at once.

robots.wheels reads the section `wheels`, robots.arm the section `arm`.
Codes: E301 shape and values · E302, W302 the URDF · E303 the footprint · W303 differences ·
E304 the arm.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from robots.agreement import check_radii, compare_body, place_on_wheels
from robots.arm import read_arm
from robots.bodies import find_body
from robots.declared import (
    FOOTPRINT,
    RADIUS,
    SHAPE,
    X,
    Y,
)
from robots.fixed_base import (
    is_fixed,
    measured_footprint,
    measured_height,
    on_column,
    read_height,
    read_mount,
    standing,
)
from robots.named_urdf import read_model, read_source
from robots.sensor_drivers.kinds import checked_parameters
from robots.sensors import (
    check_links,
    check_scan_names,
    named,
    optional,
    parameters_of,
    read_camera,
    read_depth_camera,
    read_lidar,
    read_sonar,
)
from robots.urdf.one_axle import on_one_axle
from robots.urdf.physics import physics_urdf
from robots.wheels import (
    as_modelled,
    check_joints,
    check_lateral_speed,
    read_skid,
    read_wheels,
)
from stack.documents import Findings, Node, Section, read_document
from stack.drivetrain.description import (
    BASE,
    BatteryDescription,
    ImuDescription,
    OdometryNoise,
    RobotDescription,
)
from stack.drivetrain.fixed import NoWheels
from stack.drivetrain.limits import Limits
from stack.drivetrain.wheel_loop import WheelGains
from stack.errors import InputError, ParameterError
from stack.geometry.polygons import points_inside
from stack.parameters import Declaration, suggestion
from stack.sim.worlds.world_file import named_file
from stack.types import FloatArray, Footprint

HERE = Path(__file__).parent
ACTUAL = Declaration(
    "actual", str,
    "robot file of the robot that is simulated, with its real wheels and mounts; default: this one",
    default="",
)  # fmt: skip
KEYS = ("robot", "footprint", "wheels", "urdf", "height", "limits", "lidar", "odometry", "arm")
"""Of a robot file; a file without any is of another kind."""


def robot_names() -> list[str]:
    """Names of the robots that are part of treepilot."""
    return sorted(file.parent.name for file in HERE.glob("*/robot.yaml"))


def find_robot(name_or_path: str, beside: Path) -> Path:
    """Return the path of a robot.yaml.

    Args:
        name_or_path: a name such as `scout`, or the path of a robot.yaml or of its folder (with a
            slash or a suffix), relative to the file that mentions it.
        beside: that file, or its folder.

    Raises:
        InputError: there is no robot of that name. A path is not checked here.
    """
    known = {name: HERE / name / "robot.yaml" for name in robot_names()}
    path = named_file("robot", name_or_path, beside, known)
    try:
        return path / "robot.yaml" if path.is_dir() else path
    except OSError as error:
        raise InputError(f"robot {name_or_path:.60}…: {error.strerror}") from None


def read_robot(path: Path, text: str | None = None) -> RobotDescription:
    """Read a robot.yaml.

    Args:
        path: the file.
        text: unsaved content of an editor, read instead of the file.

    Raises:
        InputError: all findings, each with its position.
    """
    findings = Findings()
    document = read_document(path, "robot file", text, KEYS)
    top = Section(document, findings, "a robot file", SHAPE)
    name = top.name(Declaration("robot", str, "name of the robot"))
    top.value(Declaration("format", int, "file format", default=1, at_least=1, at_most=1))
    top.value(Declaration("doc", str, "description", default=""))
    body, body_parameters = _body(top)
    actual_name = top.value(ACTUAL)
    fixed = is_fixed(top)
    footprint, height = _footprint(top, required=not fixed), read_height(top, fixed=fixed)
    wheels = NoWheels() if fixed else read_wheels(top)
    source = read_source(top, path)
    model = None if source is None else read_model(top, source)
    mount, arm = read_mount(top, fixed=fixed), read_arm(top, model)
    limits = parameters_of(top.section("limits"), Limits)
    check_lateral_speed(top, wheels, limits)
    skid = read_skid(top, wheels)
    gains = parameters_of(top.section("wheel_control"), WheelGains)
    odometry = parameters_of(top.section("odometry"), OdometryNoise)
    lidar, camera = optional(top, "lidar", read_lidar), optional(top, "camera", read_camera)
    lidars, sonars = named(top, "lidars", read_lidar), named(top, "sonars", read_sonar)
    depth_cameras = named(top, "depth_cameras", read_depth_camera)
    check_scan_names(top, lidars, depth_cameras)
    if model is not None:
        check_links(top, model.links, camera, depth_cameras)
    imu = optional(top, "imu", lambda section: parameters_of(section, ImuDescription))
    battery = parameters_of(top.section("battery"), BatteryDescription)
    drivers = _sensor_drivers(top, [*lidars, *(["lidar"] if lidar is not None else [])])
    components = _components(top)
    top.done()
    placement = simulated = None
    if model is not None and fixed:
        simulated, placement = on_column(model, mount), standing(mount)
        footprint = footprint or measured_footprint(model)
        height = height or measured_height(model, mount)
    elif model is not None and wheels is not None and check_joints(top, model, wheels):
        check_radii(top, model, wheels)
        simulated = on_one_axle(model, wheels.sides, wheels.radius)
        placement = place_on_wheels(top, simulated, wheels)
        wheels = as_modelled(top, wheels, placement.at)
    findings.raise_errors()
    assert footprint is not None and wheels is not None and source is not None
    assert height is not None
    assert model is not None and placement is not None and simulated is not None
    driven = () if arm is None else arm.all_joints
    text = physics_urdf(simulated, placement.base, placement.turned, findings, driven, fixed=fixed)
    findings.raise_errors()
    robot = RobotDescription(
        name, footprint, height, source.path, wheels, limits, odometry, lidar, camera, imu,
        battery, components, path, lidars, sonars, body, skid, depth_cameras, text,
        body_parameters=body_parameters, sensor_drivers=drivers, wheel_control=gains,
        arm=arm, links=model.links_below(BASE, placement.base),
    )  # fmt: skip
    compare_body(top, model, placement.base, robot)
    actual = _actual(top, robot, path, actual_name) if actual_name else None
    findings.raise_errors()
    return replace(robot, warnings=tuple(findings.items), actual=actual)


def _actual(
    top: Section, robot: RobotDescription, path: Path, name: str
) -> RobotDescription | None:
    """Read the robot that is simulated in place of a described one."""
    actual, sentence = None, ""
    try:
        actual = read_robot(find_robot(name, path.parent))
    except InputError as error:
        sentence = f"actual: {error}"
    if actual is not None:
        if actual.actual is not None:
            sentence = f"actual: {name} names another robot itself"
        elif actual.drivetrain.driven_joints != robot.drivetrain.driven_joints:
            sentence = f"actual: {name} has other driven wheels"
        elif set(actual.real_lidars) != set(robot.real_lidars):
            sentence = f"actual: {name} has other lidars"
        elif _camera_names(actual) != _camera_names(robot):
            sentence = f"actual: {name} has other cameras"
    if sentence:
        top.findings.add(SHAPE, top.mark_of(ACTUAL.name), sentence)
    return actual


def _camera_names(robot: RobotDescription) -> set[str]:
    return {*robot.depth_cameras, *(["camera"] if robot.camera else [])}


def _footprint(top: Section, *, required: bool) -> Footprint | None:
    """Read a footprint: the radius of a circle, or the corners of a polygon.

    Clockwise corners are reversed.
    """
    node = top.node_of("footprint", required=required)
    if node is None:
        return None
    if node.is_mapping:
        section = top.part("footprint", node)
        radius = section.value(RADIUS)
        section.done()
        return None if radius is None else Footprint.circle(radius)
    if not node.is_sequence:
        sentence = f"footprint: expected {{radius: 22 cm}} or corners, got {node.words()}"
        top.findings.add(FOOTPRINT, node.mark, sentence)
        return None
    corners = [top.parts(f"footprint[{n}]", item, (X, Y)) for n, item in enumerate(node.items)]
    if any(corner is None for corner in corners):
        return None
    return _polygon(top, node, np.array(corners, dtype=np.float64).reshape(-1, 2))


def _polygon(top: Section, node: Node, points: FloatArray) -> Footprint | None:
    if len(points) < 3:
        sentence = f"footprint: a polygon has at least 3 corners, got {len(points)}"
        top.findings.add(FOOTPRINT, node.mark, sentence)
        return None
    following = np.roll(points, -1, axis=0)
    repeated = np.all(points == following, axis=1)
    if repeated.any():  # e.g. the first corner repeated at the end
        return _polygon(top, node, points[~repeated])
    crosses = points[:, 0] * following[:, 1] - points[:, 1] * following[:, 0]
    area = float(crosses.sum()) / 2
    if abs(area) < 1e-6:
        sentence = f"footprint: these {len(points)} corners enclose no area"
        top.findings.add(FOOTPRINT, node.mark, sentence)
        return None
    if not points_inside(np.zeros((1, 2)), points)[0]:
        sentence = "footprint: the base frame's origin [0, 0] is not inside"
        hint = "give corners relative to the point midway between the drive wheels"
        top.findings.add(FOOTPRINT, node.mark, sentence, hint)
        return None
    return Footprint(points if area > 0 else points[::-1].copy())


def _body(top: Section) -> tuple[str, dict[str, Any]]:
    """Read which body drives the robot, by name or `{use: NAME}`, and its parameters."""
    node = top.node_of("body")
    if node is None:
        return RobotDescription.body, {}
    values = node.plain() if node.is_mapping else {"use": node.value}
    name = values.pop("use", None)
    if not isinstance(name, str):
        sentence = f"body must be a name, or a mapping with `use`, got {node.words()}"
        top.findings.add(SHAPE, node.mark, sentence)
        return RobotDescription.body, {}
    try:
        find_body(name, values)
    except ParameterError as error:
        top.findings.add(SHAPE, node.mark, str(error), error.hint)
    except InputError as error:
        top.findings.add(SHAPE, node.mark, str(error))
    return name, values


def _sensor_drivers(
    top: Section, lidars: Collection[str]
) -> dict[str, tuple[str, Mapping[str, Any]]]:
    """Read which drivers read the sensors of a real robot: `sensors: {lidar: {use: NAME, …}}`."""
    section = top.section("sensors")
    found: dict[str, tuple[str, Mapping[str, Any]]] = {}
    for key, node in section.node.entries if section is not None else ():
        sensor = f"{key.value}"
        values = node.plain() if node.is_mapping else {"use": node.value}
        use = values.pop("use", None)
        if sensor not in lidars:
            hint = suggestion(sensor, lidars) if lidars else "describe it under `lidars`"
            top.findings.add(SHAPE, key.mark, f"sensors: the robot has no lidar {sensor!r}", hint)
            continue
        if not isinstance(use, str):
            sentence = f"sensors: {sensor} must be a mapping with `use`, got {node.words()}"
            top.findings.add(SHAPE, node.mark, sentence)
            continue
        try:
            checked_parameters(use, values)
        except ParameterError as error:
            top.findings.add(SHAPE, node.mark, f"{sensor}: {error}", error.hint)
        except InputError as error:
            top.findings.add(SHAPE, node.mark, f"{sensor}: {error}")
        found[sensor] = (use, values)
    return found


def _components(top: Section) -> dict[str, Any]:
    """Component choices by kind, unchecked: the mission checks them together with its own."""
    section = top.section("navigation")
    entries = [(f"{key.value}", node) for key, node in (section.node.entries if section else ())]
    localisation = top.node_of("localisation")
    if localisation is not None:
        entries.append(("localisation", localisation))
    found: dict[str, Any] = {}
    for kind, node in entries:
        use = node.get("use") if node.is_mapping else node
        if use is not None and not (isinstance(use.value, str) and use.value):
            expected = "a name or {use: name, parameter: value}"
            top.findings.add(SHAPE, use.mark, f"{kind} must be {expected}, got {use.words()}")
            continue
        found[kind] = node.plain() if node.is_mapping else {"use": node.value}
    return found
