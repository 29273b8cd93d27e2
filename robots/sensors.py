"""Reader of the sensors in robot.yaml: lidars, sonars, cameras and depth cameras."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from math import degrees, pi, radians, remainder, tan
from typing import Any, TypeVar

from robots.declared import SHAPE, X, Y, Z
from stack.documents import Node, Section
from stack.drivetrain.description import (
    SCAN_SUFFIX,
    CameraDescription,
    DepthCameraDescription,
    DepthScanDescription,
    LidarDescription,
    SonarDescription,
)
from stack.parameters import Declaration, suggestion
from stack.sim.worlds.values import fields_of
from stack.types import DISTORTION, CameraModel, Pose2D

T = TypeVar("T")

FOCAL = tuple(
    Declaration(name, float, f"focal length along {axis}", "px", above=0.0, at_most=1e5)
    for name, axis in (("fx", "x"), ("fy", "y"))
)
CENTRE = tuple(
    Declaration(name, float, f"principal point along {axis}, from the picture's corner", "px",
                at_least=-1e4, at_most=1e4)
    for name, axis in (("cx", "x"), ("cy", "y"))
)  # fmt: skip
COEFFICIENTS = tuple(
    Declaration(name, float, "distortion coefficient, OpenCV's order", at_least=-100, at_most=100)
    for name in DISTORTION
)

MASK = tuple(
    Declaration(name, float, "direction in the sensor's frame, positive to the left", "rad",
                at_least=-2 * pi, at_most=2 * pi)
    for name in ("from", "to")
)  # fmt: skip

LEVEL = radians(3.0)
"""Tilt of a lidar that is used as level: 1 m in height at 20 m."""

ROLL = Declaration(
    "roll", float, "0, or 180 deg for a lidar that is mounted upside down", "rad", 0.0,
    at_least=-pi - 1e-6, at_most=pi + 1e-6,
)  # fmt: skip
TILT = Declaration(
    "pitch", float, "0: tilted lidars are not supported", "rad", 0.0, at_least=-pi, at_most=pi
)

YAW = Declaration("yaw", float, "positive to the left", "rad", 0.0, at_least=-pi, at_most=2 * pi)
PITCH = Declaration(
    "pitch", float, "positive looking down", "rad", 0.0, at_least=-pi / 2, at_most=pi / 2
)
CAMERA_ROLL = Declaration(
    "roll", float, "about the optical axis, clockwise", "rad", 0.0, at_least=-pi - 1e-6,
    at_most=pi + 1e-6,
)  # fmt: skip
PIXELS = tuple(
    Declaration(
        name, int, f"{name} of the picture in pixels", default=default, at_least=16, at_most=4096
    )
    for name, default in (("width", 320), ("height", 240))
)
RESERVED = ("lidar", "camera", "wheels", "imu", "battery")
"""Names of the sensors that have sections of their own."""
FIELD_OF_VIEW = Declaration(
    "field_of_view", float, "horizontal opening angle", "rad", pi * 70 / 180, above=0.0, at_most=2.8
)


def parameters_of(section: Section | None, kind: type[T], **more: Any) -> T:
    """Read a parameter dataclass from a section; `more` has the fields without declaration.

    Without a section all parameters have their defaults.
    """
    if section is None:
        return kind(**more)
    values = fields_of(section, kind)
    section.done()
    return kind(**values, **more)


def read_lidar(section: Section) -> LidarDescription:
    """Read a lidar."""
    mask, upside_down = _mask(section), _upside_down(section)
    if upside_down:  # seen from above, its angles run the other way
        mask = tuple((-last, -first) for first, last in mask)
    lidar = parameters_of(
        section, LidarDescription, mount=_mount(section), mask=mask, upside_down=upside_down
    )
    for key, worst, limit in (
        ("range_min", lidar.range_min, lidar.range_max),
        ("field_of_view", lidar.field_of_view, 2 * pi + 1e-9),
    ):
        if worst >= limit:
            sentence = f"{key}: {worst:g} must be below {limit:g}"
            section.findings.add(SHAPE, section.mark_of(key), sentence)
    return lidar


def _upside_down(section: Section) -> bool:
    """Read `roll` and `pitch`; return whether the lidar is upside down. Report a tilted one."""
    roll, pitch = section.value(ROLL), section.value(TILT)
    across = abs(remainder(roll, pi))
    if across > LEVEL or abs(pitch) > LEVEL:
        key = "roll" if across > LEVEL else "pitch"
        tilt = degrees(across if key == "roll" else abs(pitch))
        sentence = f"{key}: a lidar tilted by {tilt:.0f} deg does not scan parallel to the floor"
        hint = "mount it level, or upside down (`roll: 180 deg`); tilted lidars are not supported"
        section.findings.add(SHAPE, section.mark_of(key), sentence, hint)
    return bool(abs(roll) > pi / 2)


def _mask(section: Section) -> tuple[tuple[float, float], ...]:
    """Read the directions in which a lidar sees its own robot; none wider than half a turn."""
    node = section.node_of("mask")
    if node is None:
        return ()
    if not node.is_sequence:
        sentence = f"mask: expected a list of [from, to], got {node.words()}"
        section.findings.add(SHAPE, node.mark, sentence, "such as [[-32 deg, -28 deg]]")
        return ()
    read = [section.parts(f"mask[{n}]", item, MASK) for n, item in enumerate(node.items)]
    for item, limits in zip(node.items, read, strict=True):
        if limits is not None and not 0.0 < (width := (limits[1] - limits[0]) % (2 * pi)) <= pi:
            sentence = f"mask: from `from` anticlockwise to `to` it is {degrees(width):.0f} deg"
            hint = "write the smaller angle first; a mask has at most half a turn"
            section.findings.add(SHAPE, item.mark, sentence, hint)
    return tuple((limits[0], limits[1]) for limits in read if limits is not None)


def read_camera(section: Section) -> CameraDescription:
    """Read the camera."""
    camera = parameters_of(section, CameraDescription, model=_model(section))
    limit = min(1.0 / camera.rate, 2.0 * camera.latency)
    if camera.exposure > limit:
        sentence = (
            f"exposure: {camera.exposure:g} s must be at most {limit:g} s, the time between two "
            "pictures and twice the latency, which counts from the middle of the exposure"
        )
        section.findings.add(SHAPE, section.mark_of("exposure"), sentence)
    return camera


def read_depth_camera(section: Section) -> DepthCameraDescription:
    """Read a depth camera."""
    scan = optional(section, "scan", _scan)
    camera = parameters_of(section, DepthCameraDescription, model=_model(section), scan=scan)
    if camera.range_min >= camera.range_max:
        sentence = f"range_min: {camera.range_min:g} must be below {camera.range_max:g}"
        section.findings.add(SHAPE, section.mark_of("range_min"), sentence)
    return camera


def _scan(section: Section) -> DepthScanDescription:
    scan = parameters_of(section, DepthScanDescription)
    if scan.low >= scan.high:
        sentence = f"low: {scan.low:g} must be below {scan.high:g}"
        section.findings.add(SHAPE, section.mark_of("low"), sentence)
    return scan


def _model(section: Section) -> CameraModel:
    width, height = (section.value(declared) for declared in PIXELS)
    fx, fy = _focal_lengths(section, width)
    centre = _listed(section, "principal_point", CENTRE)
    distortion = _listed(section, "distortion", COEFFICIENTS) or ()
    node = section.node_of("position", required=True)
    position = None if node is None else section.parts("position", node, (X, Y, Z))
    x, y, z = position or (0.0, 0.0, 0.0)
    model = CameraModel(
        width, height, fx, (x, y, z), section.value(PITCH), section.value(YAW), fy,
        centre, distortion if any(distortion) else (),  # type: ignore[arg-type]
        section.value(CAMERA_ROLL),
    )  # fmt: skip
    _check_lens(section, model)
    return model


def _focal_lengths(section: Section, width: int) -> tuple[float, float | None]:
    """Read the focal lengths in pixels, given as such or as a field of view."""
    given = _listed(section, "focal_length", FOCAL)
    view = section.value(FIELD_OF_VIEW)
    if given is None:
        return width / 2 / tan(view / 2), None
    if section.node.get("field_of_view") is not None:
        sentence = "field_of_view: follows from focal_length; only one of the two can be set"
        at = section.key_mark("field_of_view")
        section.findings.add(SHAPE, at, sentence, "remove `field_of_view`")
    return given[0], given[1]


def _listed(
    section: Section, key: str, declared: tuple[Declaration, ...]
) -> tuple[float, ...] | None:
    node = section.node_of(key)
    return None if node is None else section.parts(key, node, declared)


def _check_lens(section: Section, model: CameraModel) -> None:
    """Report a principal point outside the picture, and a distortion that folds the picture."""
    node = section.node.get("principal_point")
    if node is not None and not (0 < model.cx < model.width and 0 < model.cy < model.height):
        sentence = (
            f"principal_point: [{model.cx:g}, {model.cy:g}] is outside the picture of "
            f"{model.width} x {model.height} pixels"
        )
        section.findings.add(SHAPE, node.mark, sentence)
    node = section.node.get("distortion")
    if node is not None and not model.is_invertible():
        sentence = "distortion: some pixels at the border have no ray with these coefficients"
        hint = "calibrate with the board in the corners of the picture, or set k3 and k2 to 0"
        section.findings.add(SHAPE, node.mark, sentence, hint)


def check_scan_names(
    top: Section, lidars: Mapping[str, object], cameras: Mapping[str, DepthCameraDescription]
) -> None:
    """Report a virtual scan that has the name of a lidar."""
    for name, camera in cameras.items():
        scan = f"{name}{SCAN_SUFFIX}"
        if camera.scan is not None and scan in lidars:
            sentence = f"lidars: the name `{scan}` is that of the scan of the depth camera `{name}`"
            top.findings.add(SHAPE, top.key_mark("lidars"), sentence)


def check_links(
    top: Section, links: Collection[str], camera: CameraDescription | None,
    depth_cameras: Mapping[str, DepthCameraDescription],
) -> None:  # fmt: skip
    """Report cameras on links that the URDF does not have, and scans of cameras that move.

    Args:
        top: the robot file.
        links: of the URDF.
        camera: of colours.
        depth_cameras: by name.
    """
    listed = top.node.get("depth_cameras")
    nodes = {name: listed.get(name) if listed is not None else None for name in depth_cameras}
    every: list[tuple[str, Node | None, CameraDescription | DepthCameraDescription]] = [
        (name, nodes[name], described) for name, described in depth_cameras.items()
    ]
    if camera is not None:
        every.append(("camera", top.node.get("camera"), camera))
    for name, node, described in every:
        mark = top.mark if node is None else (node.get("link") or node).mark
        if described.link and described.link not in links:
            sentence = f"{name}: link: the URDF has no link {described.link!r}"
            top.findings.add(SHAPE, mark, sentence, suggestion(described.link, links))
        elif described.link and isinstance(described, DepthCameraDescription) and described.scan:
            sentence = f"{name}: a camera on a link that moves has no scan"
            top.findings.add(SHAPE, mark, sentence, "remove `scan`, or mount it on the base")


def optional(top: Section, key: str, read: Callable[[Section], T]) -> T | None:
    """Read the section under a key; None without it."""
    section = top.section(key)
    return None if section is None else read(section)


def named(top: Section, key: str, read: Callable[[Section], T]) -> dict[str, T]:
    """Read the sections of a mapping, by name."""
    section = top.section(key)
    found: dict[str, T] = {}
    for name, node in section.node.entries if section is not None else ():
        if name.value in RESERVED:
            top.findings.add(SHAPE, name.mark, f"{key}: the name `{name.value}` is reserved")
            continue
        part = Section(node, top.findings, f"`{key}.{name.value}`", SHAPE).at(name)
        found[str(name.value)] = read(part)
    return found


def read_sonar(section: Section) -> SonarDescription:
    """Read a sonar."""
    return parameters_of(section, SonarDescription, mount=_mount(section))


def _mount(section: Section) -> Pose2D:
    node = section.node_of("position")
    position = None if node is None else section.parts("position", node, (X, Y))
    x, y = position or (0.0, 0.0)
    return Pose2D(x, y, section.value(YAW))
