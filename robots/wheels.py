"""Reader of the section `wheels` of robot.yaml for each kind of drive; checks the URDF's joints."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from robots.declared import FARTHEST, HEADING, RADIUS, SHAPE, URDF, X, Y, length
from robots.sensors import parameters_of
from robots.urdf.model import RobotModel
from stack.documents import Node, Section
from stack.documents.xml_file import Element
from stack.drivetrain.ackermann import Ackermann, SteeredWheels
from stack.drivetrain.differential import Differential, Wheels
from stack.drivetrain.drivetrain import WheelGeometry
from stack.drivetrain.limits import Limits
from stack.drivetrain.omnidirectional import Omnidirectional, OmniWheels
from stack.drivetrain.skid_steered import Skid, SkidSteered, SkidWheels
from stack.parameters import Declaration, suggestion
from stack.types import Pose2D

DRIVE = Declaration(
    "drive", str, "kind of drive", default=Differential.kind,
    one_of=(Differential.kind, SkidSteered.kind, Omnidirectional.kind, Ackermann.kind),
)  # fmt: skip
LEFT = Declaration("left", list[str], "URDF joints of the left wheels")
RIGHT = Declaration("right", list[str], "URDF joints of the right wheels")
SEPARATION = length("separation", "distance between the centres of left and right wheels")
MOUNTS = Declaration("mounts", list[Any], "omnidirectional wheels, each {joint: …, at: …}")
JOINT = Declaration("joint", str, "URDF joint of the wheel")
AT = (X, Y, HEADING)
STEERING = Declaration(
    "steering", list[str], "URDF joints that turn the front wheels, left and right"
)
REAR = Declaration("rear", list[str], "URDF joints of the driven rear wheels, left and right")
WHEELBASE = length("wheelbase", "distance between the rear and the front axle")
TRACK = length("track", "distance between the centres of left and right wheels")
STEERING_ANGLE = Declaration(
    "steering_angle", float, "largest steering angle at the middle of the front axle", "rad",
    above=0.0, at_most=1.4,
)  # fmt: skip
STEERING_SPEED = Declaration(
    "steering_speed", float, "rate of the steering angle", "rad/s", above=0.0
)

EFFECTIVE_TRACK = length(
    "effective_track",
    "track for which the difference of both sides gives the turn; larger than track, calibrated",
)
ICR_OFFSET = Declaration(
    "icr_offset", float, "position of the centres of rotation along x of the base frame", "m", 0.0,
    at_least=-FARTHEST, at_most=FARTHEST,
)  # fmt: skip

EFFECTIVE_RADII = Declaration(
    "effective_radii", list[float],
    "calibrated radii of the left and the right wheels, or of each wheel of `mounts`", "m", [],
    above=0.0, at_most=FARTHEST,
)  # fmt: skip


def _calibrated(name: str, help: str) -> Declaration:
    """Declare a length that `treepilot calibrate odometry` determines."""
    kind: Any = float | None
    return Declaration(name, kind, help, "m", None, above=0.0, at_most=FARTHEST)


SEPARATION_OF_TURNS = _calibrated(
    "effective_track", "calibrated separation that gives the turn; default: separation"
)
EFFECTIVE_WHEELBASE = _calibrated(
    "effective_wheelbase", "calibrated wheelbase that gives the turn; default: wheelbase"
)
EFFECTIVE_LEVER = _calibrated(
    "effective_lever", "calibrated mean lever arm of the wheels; default: that of the mounts"
)

KEYS: dict[str, tuple[Declaration, ...]] = {
    Differential.kind: (LEFT, RIGHT, RADIUS, SEPARATION, SEPARATION_OF_TURNS, EFFECTIVE_RADII),
    SkidSteered.kind: (
        LEFT, RIGHT, RADIUS, TRACK, EFFECTIVE_TRACK, ICR_OFFSET, EFFECTIVE_RADII,
    ),
    Omnidirectional.kind: (MOUNTS, RADIUS, EFFECTIVE_LEVER, EFFECTIVE_RADII),
    Ackermann.kind: (
        STEERING, REAR, RADIUS, WHEELBASE, TRACK, STEERING_ANGLE, STEERING_SPEED,
        EFFECTIVE_WHEELBASE, EFFECTIVE_RADII,
    ),
}  # fmt: skip
"""The keys of `wheels` besides `drive`, by kind of drive."""

GEOMETRIES: dict[str, Callable[..., WheelGeometry]] = {
    Differential.kind: Wheels,
    SkidSteered.kind: SkidWheels,
    Ackermann.kind: SteeredWheels,
}

LEAST_SINGULAR_VALUE = 1e-3
"""Of the wheels' Jacobian; below it some velocity needs wheels a thousand times as fast."""

TIGHT = "use a smaller steering_angle, a longer wheelbase or a narrower track"


def read_wheels(top: Section) -> WheelGeometry | None:
    """Read the wheels; None if something is wrong, which is reported."""
    section = top.section("wheels", required=True)
    if section is None:
        return None
    kind = section.value(DRIVE)
    written = section.node.get("drive")
    if written is not None and written.value not in KEYS:
        return None  # the other keys depend on the kind of drive
    wheels = _omni(section) if kind == Omnidirectional.kind else _listed(section, kind)
    _report_misplaced(section, kind)
    section.done()
    return wheels


def check_lateral_speed(top: Section, wheels: WheelGeometry | None, limits: Limits) -> None:
    """Check that lateral_speed is above 0 for omnidirectional wheels and 0 for others."""
    if wheels is None:
        return
    listed = top.node.get("limits")
    written = listed.get("lateral_speed") if listed is not None else None
    mark = top.key_mark("limits") if written is None else written.mark
    moves_sideways = wheels.drivetrain(limits).can_move_sideways
    if moves_sideways and limits.lateral_speed <= 0.0:
        sentence = "limits: an omnidirectional robot needs a lateral_speed above 0"
        top.findings.add(SHAPE, mark, sentence, "add e.g. lateral_speed: 0.5 m/s")
    elif not moves_sideways and limits.lateral_speed > 0.0:
        sentence = (
            f"lateral_speed: these wheels cannot drive sideways, got {limits.lateral_speed:g}"
        )
        hint = "remove it, or describe omnidirectional wheels (drive: omni)"
        top.findings.add(SHAPE, mark, sentence, hint)


def read_skid(top: Section, wheels: WheelGeometry | None) -> Skid:
    """Read the section `skid`, which only a skid-steered drive may have."""
    section = top.section("skid")
    if section is not None and wheels is not None and not wheels.drivetrain(Limits()).skids:
        sentence = "skid: these wheels do not skid in turns"
        hint = f"remove it, or describe a skid-steered drive (drive: {SkidSteered.kind})"
        top.findings.add(SHAPE, section.mark, sentence, hint)
    return parameters_of(section, Skid)


def check_joints(top: Section, model: RobotModel, wheels: WheelGeometry) -> bool:
    """Check that wheels are continuous joints of the URDF and steering joints revolute ones.

    Returns:
        Whether the URDF has all of them.
    """
    before = len(top.findings.errors)
    listed = top.node.get("wheels")
    for named in _named_joints(listed) if listed is not None else ():
        joint = model.joints.get(named.name)
        if joint is None:
            sentence = f"wheels: the URDF has no joint {named.name!r}"
            hint: str = suggestion(named.name, model.joints)
            top.findings.add(URDF, named.node.mark, sentence, hint)
        elif joint.kind != named.wanted:
            sentence = f"wheels: the URDF's joint {named.name!r} is {joint.kind}"
            hint = f"a {named.role} joint must be {named.wanted}"
            top.findings.add(URDF, named.node.mark, sentence, hint)
        elif named.wanted == "revolute":
            limit = wheels.drivetrain(Limits()).steering_limit
            _check_joint_limit(top, named, joint.element, limit)
    return len(top.findings.errors) == before


def _listed(section: Section, kind: str) -> WheelGeometry | None:
    """Read wheels that are listed by side or by axle; their keys are the fields."""
    keys = [declared for declared in KEYS[kind] if declared is not EFFECTIVE_RADII]
    values = {declared.name: _value(section, declared) for declared in keys}
    if any(values[declared.name] is None for declared in keys if declared.default is not None):
        return None
    values[EFFECTIVE_RADII.name] = _radii(section, 2)
    wheels: WheelGeometry = GEOMETRIES[kind](**values)
    try:
        wheels.check()
    except ValueError as error:
        section.findings.add(SHAPE, section.mark, str(error), TIGHT)
        return None
    return wheels


def _radii(section: Section, count: int) -> tuple[float, ...]:
    """Read the calibrated radii of so many wheels; empty if there are none."""
    radii = section.value(EFFECTIVE_RADII) or []
    if radii and len(radii) != count:
        name = EFFECTIVE_RADII.name
        sentence = f"{name}: expected {count} radii, got {len(radii)}"
        section.findings.add(SHAPE, section.mark_of(name), sentence)
        return ()
    return tuple(radii)


def _value(section: Section, declared: Declaration) -> Any:
    """Read a key; joints as a tuple: any number of a side, left and right of an axle."""
    value, name = section.value(declared), declared.name
    if not isinstance(value, list):
        return value
    if declared in (STEERING, REAR) and len(value) != 2:
        sentence = f"{name}: expected [left, right], got {len(value)} joints"
        section.findings.add(SHAPE, section.mark_of(name), sentence)
        return None
    if not value:
        hint = f"add one, e.g. {name}: [{name}_wheel]"
        section.findings.add(SHAPE, section.mark_of(name), f"wheels: {name} has no joint", hint)
    return tuple(value) or None


def _omni(section: Section) -> OmniWheels | None:
    radius = section.value(RADIUS)
    items = section.sequence("mounts", required=True)
    read = [_mount(section, item) for item in items]
    found = [mount for mount in read if mount is not None]
    if radius is None or not items or len(found) < len(items):
        return None
    joints, mounts = tuple(j for j, _ in found), tuple(at for _, at in found)
    wheels = OmniWheels(
        joints, mounts, radius, section.value(EFFECTIVE_LEVER), _radii(section, len(joints))
    )
    _check_mounts(section, wheels)
    return wheels


def _mount(section: Section, node: Node) -> tuple[str, Pose2D] | None:
    """Read a wheel: its joint, and its contact point with the driving direction as heading."""
    mount = Section(node, section.findings, "a wheel under `mounts`", SHAPE)
    joint, at = mount.value(JOINT), mount.node_of("at", required=True)
    place = None if at is None else mount.parts("at", at, AT)
    mount.done()
    return None if joint is None or place is None else (joint, Pose2D(*place))


def _check_mounts(section: Section, wheels: OmniWheels) -> None:
    if len(wheels.mounts) < 3:
        sentence = f"mounts: at least 3 wheels are required, got {len(wheels.mounts)}"
        section.findings.add(SHAPE, section.mark_of("mounts"), sentence)
    elif float(np.linalg.svd(wheels.jacobian, compute_uv=False)[-1]) < LEAST_SINGULAR_VALUE:
        sentence = "mounts: these wheels cannot drive forward, sideways and turn independently"
        hint = "their lines of driving must not all be parallel nor all meet in one point"
        section.findings.add(SHAPE, section.mark_of("mounts"), sentence, hint)


def as_modelled(
    top: Section, wheels: WheelGeometry, at: Mapping[str, tuple[float, float]]
) -> WheelGeometry:
    """Return the wheels with what only the URDF tells.

    Args:
        top: the robot file.
        wheels: as described.
        at: (x, y) of the joints, base frame, metres.
    """
    try:
        return wheels.as_modelled(at)
    except ValueError as error:
        top.findings.add(SHAPE, top.node.mark, str(error), TIGHT)
        return wheels


def _report_misplaced(section: Section, kind: str) -> None:
    """Report keys that belong to other kinds of drive."""
    kinds: dict[str, list[str]] = {}
    for each, keys in KEYS.items():
        for declared in keys:
            kinds.setdefault(declared.name, []).append(each)
    for name, its_kinds in kinds.items():
        if kind in its_kinds or section.node.get(name) is None:
            continue
        section.node_of(name)  # `done` is not to report it again
        others = " or ".join(its_kinds)
        sentence = f"wheels: {name!r} is for drive: {others}, but this is drive: {kind}"
        section.findings.add(SHAPE, section.key_mark(name), sentence)


@dataclass(frozen=True, slots=True)
class _NamedJoint:
    """A joint that `wheels` names: its position in the file, its role and its required type."""

    name: str
    node: Node
    role: str
    wanted: str


def _named_joints(listed: Node) -> Iterator[_NamedJoint]:
    for key in (LEFT.name, RIGHT.name, REAR.name, STEERING.name):
        node = listed.get(key)
        role = ("steering", "revolute") if key == STEERING.name else ("wheel", "continuous")
        for item in node.items if node is not None else ():
            yield _NamedJoint(str(item.value), item, *role)
    mounts = listed.get(MOUNTS.name)
    for item in mounts.items if mounts is not None else ():
        joint = item.get(JOINT.name)
        if joint is not None:
            yield _NamedJoint(str(joint.value), joint, "wheel", "continuous")


def _check_joint_limit(top: Section, named: _NamedJoint, joint: Element, inner: float) -> None:
    """Check the limits of a steering joint: on the tightest arc the inner wheel steers most."""
    limit = joint.first("limit")
    try:
        given = limit.attributes if limit is not None else {}
        ends = [float(given.get(end) or 0.0) for end in ("lower", "upper")]
    except ValueError:
        ends = [0.0, 0.0]
    if ends[0] > -inner or ends[1] < inner:
        sentence = (
            f"wheels: the URDF's joint {named.name!r} turns from {ends[0]:g} to {ends[1]:g} rad, "
            f"but the inner wheel of the tightest arc needs {inner:.3f} rad"
        )
        hint = "widen the joint's <limit>, or reduce steering_angle"
        top.findings.add(URDF, named.node.mark, sentence, hint)
