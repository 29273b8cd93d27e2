"""Writes the text of a robot.yaml for a URDF."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import atan2, ceil, degrees, floor, hypot, pi, remainder

import numpy as np

from robots.proposal.arm import arm_lines, propose_arm
from robots.proposal.drive import DriveProposal, propose_drive
from robots.urdf.extent import points_of
from robots.urdf.model import RobotModel
from robots.urdf.reading import UrdfSource, read_urdf
from robots.urdf.sensors import ModelledSensor, numbers_of, sensors_of
from stack.drivetrain.arm_description import HOME, ArmDescription
from stack.errors import InputError
from stack.types import FloatArray

ROUND = 0.9
"""A robot is round if it reaches this share of its radius to all four sides."""

LEAST_HEIGHT = 0.03
"""Of a lidar above the floor, metres."""

FIXED = (
    "# No drive is recognised: the robot stands where a mission starts.",
    "mount: {height: 0}                   # of the root above the floor, on a column",
)
"""Lines of a robot without wheels."""

FULL_TURN = 2.0 * pi - 0.02
"""Field of view from which on a lidar sees all around, radians."""


@dataclass(frozen=True)
class RobotProposal:
    """A proposed robot file.

    Attributes:
        text: of the file.
        drive: its kind; `none` for an arm on a fixed base.
        joints: number of those of the arm; 0 without one.
        mass: of the robot, kg.
    """

    text: str
    drive: str
    joints: int
    mass: float


def propose_robot(source: UrdfSource, name: str, urdf: str) -> RobotProposal:
    """Propose a robot file.

    Args:
        source: of the URDF.
        name: of the robot; empty: that of the URDF.
        urdf: value of the key `urdf`.

    Raises:
        InputError: the URDF has errors, or there is neither an arm nor a drive that is known.
    """
    model = RobotModel(read_urdf(source)[0])
    arm = propose_arm(model)
    drive = _drive(model, arm)
    named = name or re.sub(r"\W+", "_", model.element.name).strip("_").lower() or "robot"
    where = "below the root of the URDF" if drive is None else "midway between the driven wheels"
    lines = [
        f"# Proposed from {source.path.name}. Lengths in metres, in the base frame: on the floor,",
        f"# {where}. `treepilot check` compares this file with the URDF.",
        f"robot: {named}",
        "format: 1",
        f"urdf: {urdf}",
        *(FIXED if drive is None else _driven(model, drive, arm)),
        *([] if arm is None else arm_lines(arm)),
        *_sensors(model, np.zeros(3) if drive is None else drive.base),
    ]
    kind = "none" if drive is None else drive.kind
    return RobotProposal("\n".join(lines) + "\n", kind, 0 if arm is None else len(arm.joints),
                         model.mass)  # fmt: skip


def _drive(model: RobotModel, arm: ArmDescription | None) -> DriveProposal | None:
    """Return the drive; None of an arm on a fixed base.

    Raises:
        InputError: no kind of drive fits, and there is no arm.
    """
    try:
        return propose_drive(model)
    except InputError:
        if arm is None:
            raise
        return None


def _driven(model: RobotModel, drive: DriveProposal, arm: ArmDescription | None) -> list[str]:
    """Return the lines of a base with wheels; an arm is at `home` while it drives."""
    home = {} if arm is None else dict(zip(arm.joints, arm.postures[HOME].tolist(), strict=True))
    outline, height = _outline(model, drive.base, home)
    lidar = [] if _lidars(model, drive.base) else [
        "lidar:                               # the URDF has none: correct or remove it",
        f"  {{position: [0, 0], height: {max(height, LEAST_HEIGHT):g}}}",
    ]  # fmt: skip
    return [
        f"footprint: {outline}",
        f"height: {height:g}",
        "wheels:",
        f"  drive: {drive.kind}",
        *(f"  {line}" for line in drive.lines),
        *drive.after,
        "limits:                              # not in the URDF: take them from the data sheet",
        "  linear_speed: 0.5 m/s",
        *(f"  {line}" for line in drive.limits),
        "  angular_speed: 1.5 rad/s",
        *lidar,
    ]


def _outline(model: RobotModel, base: FloatArray, joints: Mapping[str, float]) -> tuple[str, float]:
    """The footprint and the height, by the collision shapes, or without any by the visual ones.

    Args:
        model: of the robot.
        base: (3,) origin of the base frame in the root's frame.
        joints: positions of those that are not at 0.
    """
    poses = model.posed(joints)
    for tag in ("collision", "visual"):
        found = [points_of(model, name, tag, meshes=True, at=poses[name]) for name in model.links]
        points = np.concatenate(found) - base
        if len(points):
            break
    top = ceil(float(points[:, 2].max(initial=0.05)) * 100) / 100
    low = np.minimum(points[:, :2].min(axis=0, initial=-0.01), -0.01)
    high = np.maximum(points[:, :2].max(axis=0, initial=0.01), 0.01)
    reach = float(np.hypot(points[:, 0], points[:, 1]).max(initial=0.01))
    if min(-low.max(), high.min()) > ROUND * reach:
        return f"{{radius: {ceil(reach * 200) / 200:g}}}", top
    (x0, y0), (x1, y1) = np.floor(low * 200) / 200, np.ceil(high * 200) / 200
    corners = ((x1, y0), (x1, y1), (x0, y1), (x0, y0))
    return "[" + ", ".join(f"[{x:g}, {y:g}]" for x, y in corners) + "]", top


def _lidars(model: RobotModel, base: FloatArray) -> list[ModelledSensor]:
    return [
        item for item in sensors_of(model).get("lidar", []) if _at(item, base)[2] > LEAST_HEIGHT
    ]


def _sensors(model: RobotModel, base: FloatArray) -> Iterable[str]:
    found, lidars = sensors_of(model), _lidars(model, base)
    links = [item.link for item in lidars]
    for number, lidar in enumerate(lidars):
        indent = "  " if number == 0 else "    "
        yield from ["lidar:"] if number == 0 else []
        yield from ["lidars:"] if number == 1 else []
        name = lidar.link
        if links.count(name) > 1 and lidar.element is not None and lidar.element.name:
            name = lidar.element.name
        yield from [f"  {_word(name)}:"] if number else []
        for line in _lidar(lidar, base):
            yield indent + line
    for camera in (found.get("camera") or found.get("depth") or [])[:1]:
        yield from ["camera:", *(f"  {line}" for line in _camera(camera, base))]
    if "imu" in found:
        yield "imu: {rate: 100 Hz}"


def _lidar(lidar: ModelledSensor, base: FloatArray) -> Iterable[str]:
    x, y, z = _at(lidar, base)
    values = numbers_of(lidar.element)
    first, last = values.get("min_angle", -pi), values.get("max_angle", pi)
    is_sector, upside_down = 0.1 < last - first < FULL_TURN, lidar.pose[2, 2] < 0.0
    middle = degrees(first + last) / 2.0 if is_sector else 0.0  # robot.yaml counts from there
    yaw = _yaw(lidar) + (-middle if upside_down else middle)
    yield f"position: [{x:g}, {y:g}]                # the link {lidar.link}"
    if abs(yaw) >= 0.01:
        yield f"yaw: {remainder(yaw, 360.0):.4g} deg"
    if upside_down:
        yield "roll: 180 deg"
    yield f"height: {z:g}"
    if values.get("samples", 0) >= 3:
        yield f"beams: {min(int(values['samples']), 4096)}"
    if is_sector:
        yield f"field_of_view: {floor(degrees(last - first) * 10) / 10:g} deg"
    least, most = values.get("min", 0.1), values.get("max", 12.0)
    yield f"range_min: {least:g}"
    yield f"range_max: {max(most, least + 0.1):g}"
    yield f"rate: {values.get('update_rate', 0.0) or 10.0:g} Hz"


def _camera(camera: ModelledSensor, base: FloatArray) -> Iterable[str]:
    x, y, z = _at(camera, base)
    forward = camera.pose[:3, 0]
    yield f"position: [{x:g}, {y:g}, {z:g}]        # the link {camera.link}"
    yield f"pitch: {degrees(atan2(-forward[2], hypot(forward[0], forward[1]))):.3g} deg"
    yaw = _yaw(camera)
    if yaw:
        yield f"yaw: {yaw:.4g} deg"
    values = numbers_of(camera.element)
    if 16 <= values.get("width", 0) <= 4096 and 16 <= values.get("height", 0) <= 4096:
        yield f"width: {values['width']:g}"
        yield f"height: {values['height']:g}"
    if 0 < values.get("horizontal_fov", 0) < 2.8:
        yield f"field_of_view: {degrees(values['horizontal_fov']):.4g} deg"


def _at(sensor: ModelledSensor, base: FloatArray) -> tuple[float, float, float]:
    x, y, z = (np.round(sensor.pose[:3, 3] - base, 3) + 0.0).tolist()
    return x, y, z


def _yaw(sensor: ModelledSensor) -> float:
    """Direction of a sensor's x axis in the plane, degrees."""
    forward = sensor.pose[:3, 0]
    return round(degrees(atan2(forward[1], forward[0])), 2) + 0.0


def _word(name: str) -> str:
    return re.sub(r"\W+", "_", name)
