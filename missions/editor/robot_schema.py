"""JSON Schema (draft 2020-12) of robot files."""

from __future__ import annotations

from missions.editor.mission_schema import DRAFT
from missions.editor.value_schemas import Schema, documented, of_declaration, parts, section
from missions.execution.component_choices import NAVIGATION_KINDS
from robots.declared import PACKAGES, RADIUS, URDF_FILE, X, Y, Z, length
from robots.sensors import (
    CENTRE,
    COEFFICIENTS,
    FIELD_OF_VIEW,
    FOCAL,
    MASK,
    PITCH,
    PIXELS,
    ROLL,
    TILT,
    YAW,
)
from robots.wheels import AT, DRIVE, JOINT, KEYS, LEFT, MOUNTS, REAR, RIGHT, STEERING
from stack.drivetrain.description import (
    BatteryDescription,
    CameraDescription,
    DepthCameraDescription,
    DepthScanDescription,
    ImuDescription,
    LidarDescription,
    OdometryNoise,
    SonarDescription,
)
from stack.drivetrain.limits import Limits
from stack.drivetrain.skid_steered import Skid
from stack.parameters import Declaration, declarations

COMPONENT: Schema = {"type": ["string", "object"]}
HEIGHT = length("height", "total height of the robot")


def robot_schema() -> Schema:
    """Return the schema of robot files; the URDF is checked by `run` and the language server."""
    mount = {"position": parts((X, Y)), "yaw": _of(YAW)}
    tilt = {"roll": _of(ROLL), "pitch": _of(TILT)}
    lidar = {**mount, **tilt, **_fields(LidarDescription), "mask": _mask()}
    sonar = {**mount, **_fields(SonarDescription)}
    model = {
        "position": parts((X, Y, Z)), "yaw": _of(YAW), "pitch": _of(PITCH),
        "field_of_view": _of(FIELD_OF_VIEW), **{item.name: _of(item) for item in PIXELS},
        "focal_length": documented(
            parts(FOCAL), "Focal lengths in pixels, in place of `field_of_view`."
        ),
        "principal_point": documented(
            parts(CENTRE), "Pixels from the picture's corner; default: its centre."
        ),
        "distortion": documented(parts(COEFFICIENTS), "Brown-Conrady; default: none."),
    }  # fmt: skip
    camera = {**model, **_fields(CameraDescription)}
    scan = documented(section(_fields(DepthScanDescription)), str(DepthScanDescription.__doc__))
    depth_camera = {**model, **_fields(DepthCameraDescription), "scan": scan}
    keys = {
        "robot": documented({"type": "string"}, "Name of the robot."),
        "format": documented({"enum": [1]}, "Version of robot files: `1`."),
        "doc": documented({"type": "string"}, "Description."),
        "footprint": documented(_footprint(), "Outline in the base frame."),
        "height": _of(HEIGHT),
        "body": documented(
            COMPONENT,
            "What drives the robot: `simulated` (default), `scripted` or a plugin's body.",
        ),
        "urdf": documented(_urdf(), "URDF or xacro file, relative to this file."),
        "wheels": documented(_wheels(), "Wheels and drive, which define the possible motions."),
        "limits": _part(Limits),
        "skid": _part(Skid),
        "odometry": _part(OdometryNoise),
        "lidar": documented(section(lidar), str(LidarDescription.__doc__)),
        "lidars": documented(_named(lidar), "Additional lidars by name."),
        "sonars": documented(_named(sonar), "Sonars by name."),
        "camera": documented(section(camera, ["position"]), str(CameraDescription.__doc__)),
        "depth_cameras": documented(_named(depth_camera, ["position"]), "Depth cameras by name."),
        "imu": _part(ImuDescription),
        "battery": _part(BatteryDescription),
        "navigation": documented(_navigation(), "Default components; missions override them."),
        "localisation": documented(COMPONENT, "Default estimator; missions override it."),
    }
    required = ["robot", "footprint", "height", "urdf", "wheels"]
    return {"$schema": DRAFT, "title": "treepilot robot, format 1", **section(keys, required)}


def _named(fields: dict[str, Schema], required: list[str] | None = None) -> Schema:
    return {"type": "object", "additionalProperties": section(fields, required or [])}


def _urdf() -> Schema:
    keys = {
        "file": _of(URDF_FILE),
        "packages": _of(PACKAGES),
        "arguments": documented({"type": "object"}, "Values of the arguments of a xacro file."),
    }
    return {"anyOf": [{"type": "string"}, section(keys, ["file"])]}


def _mask() -> Schema:
    sentence = "Directions in which the lidar sees its own robot: [from, to], anticlockwise."
    return documented({"type": "array", "items": parts(MASK)}, sentence)


def _footprint() -> Schema:
    circle = section({"radius": _of(RADIUS)}, ["radius"])
    corners = {"minItems": 3, "items": parts((X, Y))}
    return {**circle, **corners, "type": ["object", "array"]}


def _wheels() -> Schema:
    """Return the schema of the wheels; `drive` decides which keys are allowed."""
    keys = {item.name: _of(item) for items in KEYS.values() for item in items}
    for sides in (LEFT, RIGHT):
        keys[sides.name] = {**_of(sides), "minItems": 1}
    for pair in (STEERING, REAR):
        keys[pair.name] = {**_of(pair), "minItems": 2, "maxItems": 2}
    mount = section({"joint": _of(JOINT), "at": parts(AT)}, ["joint", "at"])
    keys[MOUNTS.name] = documented({"type": "array", "minItems": 3, "items": mount}, MOUNTS.help)
    return {**section({"drive": _of(DRIVE), **keys}), "allOf": [_kind(kind) for kind in KEYS]}


def _kind(kind: str) -> Schema:
    """Return the required and forbidden keys of `drive: KIND`; no `drive` is the default kind."""
    own = {item.name for item in KEYS[kind]}
    required = [item.name for item in KEYS[kind] if item.required]
    others = {item.name for items in KEYS.values() for item in items}.difference(own)
    chosen: Schema = {"properties": {"drive": {"const": str(kind)}}}
    if kind != DRIVE.default:
        chosen["required"] = ["drive"]
    return {
        "if": chosen,
        "then": {"required": required, "properties": dict.fromkeys(sorted(others), False)},
    }


def _navigation() -> Schema:
    return section(dict.fromkeys(NAVIGATION_KINDS, COMPONENT))


def _part(kind: type) -> Schema:
    return documented(section(_fields(kind)), str(kind.__doc__))


def _fields(kind: type) -> dict[str, Schema]:
    return {name: _of(declared) for name, declared in declarations(kind).items()}


def _of(declared: Declaration) -> Schema:
    return of_declaration(declared, references=False)
