"""Recognises the drive of a URDF by the axes and places of its rolling joints."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import atan, atan2, degrees, tan

import numpy as np

from robots.urdf.extent import points_of, radii_of
from robots.urdf.model import Joint, RobotModel
from stack.errors import InputError
from stack.types import FloatArray

STRAIGHT = 0.99
"""Share of an axis that must be along the expected one."""

ON_FLOOR = 0.02
"""Wheels end within this of the lowest one, metres."""

SMALLER = 0.8
"""A wheel whose radius is a smaller share of the largest is no driven wheel but a caster."""

STEERING_RESERVE = 0.98
"""Share of the steering angle, so that the joints reach it."""


@dataclass(frozen=True)
class Wheel:
    """A rolling joint: its centre (3,) and axle (3,) in the root's frame, and its radius."""

    joint: Joint
    centre: FloatArray
    axle: FloatArray
    radius: float

    @property
    def name(self) -> str:
        """Name of the joint."""
        return self.joint.name


@dataclass(frozen=True)
class DriveProposal:
    """A drive that fits a URDF.

    Attributes:
        kind: as in robot.yaml.
        base: (3,) origin of the base frame in the root's frame.
        lines: of the section `wheels` without `drive`.
        after: lines of other sections that this kind needs.
        limits: further lines of `limits`.
    """

    kind: str
    base: FloatArray
    lines: list[str]
    after: list[str] = field(default_factory=list)
    limits: list[str] = field(default_factory=list)


def propose_drive(model: RobotModel) -> DriveProposal:
    """Recognise the drive.

    Raises:
        InputError: no kind of drive fits the rolling joints; names them.
    """
    rolling = {joint.name: _wheel(model, joint) for joint in _rolling(model)}
    wheels = _on_the_floor([wheel for wheel in rolling.values() if wheel is not None])
    steered = [joint for joint in _steering(model) if _wheels_below(model, joint, wheels)]
    under = {wheel.name for joint in steered for wheel in _wheels_below(model, joint, wheels)}
    straight = [wheel for wheel in wheels if abs(wheel.axle[1]) > STRAIGHT]
    if len(steered) == 2:
        rear = _pair([wheel for wheel in straight if wheel.name not in under])
        if rear is not None:
            return _ackermann(model, steered, rear)
    named = _commanded(model)
    if len([wheel for wheel in wheels if wheel.name in named]) >= 2:
        wheels = [wheel for wheel in wheels if wheel.name in named]
        straight = [wheel for wheel in wheels if abs(wheel.axle[1]) > STRAIGHT]
    if len(straight) < len(wheels) and len(wheels) >= 3:
        return _omni(wheels)
    largest = max((wheel.radius for wheel in straight), default=0.0)
    driven = [wheel for wheel in straight if wheel.radius >= SMALLER * largest]
    middle = float(np.mean([wheel.centre[1] for wheel in driven])) if driven else 0.0
    left = [wheel for wheel in driven if wheel.centre[1] > middle]
    right = [wheel for wheel in driven if wheel.centre[1] < middle]
    if left and len(left) == len(right):
        return _sides(left, right)
    found = ", ".join(repr(wheel.name) for wheel in wheels) or "none"
    unknown = ", ".join(repr(name) for name, wheel in rolling.items() if wheel is None)
    raise InputError(
        f"no drive is recognised in {model.element.mark.file}: the continuous joints with a "
        f"horizontal axis and a shape that reaches the floor are {found}"
        + (f"; those without a shape that can be read: {unknown}" if unknown else "")
        + "; expected the same number on both sides, three around the base, or two behind two "
        "steered ones"
    )


def _rolling(model: RobotModel) -> list[Joint]:
    """Continuous joints with a horizontal axis that no swivelling caster carries."""
    swivels = [
        joint
        for joint in model.joints.values()
        if joint.kind == "continuous" and abs(model.axis_of(joint)[2]) > STRAIGHT
    ]
    below = {found.name for joint in swivels for found in model.downwards(joint.child)}
    return [
        joint
        for joint in model.joints.values()
        if joint.kind == "continuous"
        and abs(model.axis_of(joint)[2]) < 1.0 - STRAIGHT
        and joint.name not in below
    ]


def _steering(model: RobotModel) -> list[Joint]:
    return [
        joint
        for joint in model.joints.values()
        if joint.kind == "revolute" and abs(model.axis_of(joint)[2]) > STRAIGHT
    ]


def _wheels_below(model: RobotModel, joint: Joint, wheels: list[Wheel]) -> list[Wheel]:
    names = {found.name for found in model.downwards(joint.child)}
    return [wheel for wheel in wheels if wheel.name in names]


def _wheel(model: RobotModel, joint: Joint) -> Wheel | None:
    """The wheel of a joint; None if its shapes do not tell a radius."""
    links = [joint.child, *(below.child for below in model.downwards(joint.child))]
    centre = model.poses[joint.child][:3, 3]
    radius = max((r for link in links for _, r in radii_of(model.links[link])), default=0.0)
    for tag in ("collision", "visual"):
        if not radius:
            points = np.concatenate([points_of(model, link, tag, meshes=True) for link in links])
            radius = float(np.ptp(points[:, 2])) / 2 if len(points) else 0.0
    return Wheel(joint, centre, model.axis_of(joint), round(radius, 4)) if radius else None


def _on_the_floor(wheels: list[Wheel]) -> list[Wheel]:
    floor = min((wheel.centre[2] - wheel.radius for wheel in wheels), default=0.0)
    return [wheel for wheel in wheels if wheel.centre[2] - wheel.radius < floor + ON_FLOOR]


def _commanded(model: RobotModel) -> set[str]:
    """Joints that a controller in the file commands with a velocity, or that a plugin names."""
    names = set()
    for control in model.element.all("ros2_control"):
        for joint in control.all("joint"):
            if any(i.name == "velocity" for i in joint.all("command_interface")):
                names.add(joint.name)
    for gazebo in model.element.all("gazebo"):
        names |= {
            part.text for plugin in gazebo.all("plugin") for part in plugin.within()
            if "joint" in part.tag.lower()
        }  # fmt: skip
    return names


def _pair(wheels: list[Wheel]) -> tuple[Wheel, Wheel] | None:
    """Left and right of two wheels; None of any other number."""
    if len(wheels) != 2:
        return None
    right, left = sorted(wheels, key=lambda wheel: float(wheel.centre[1]))
    return left, right


def _base(wheels: list[Wheel]) -> FloatArray:
    centres: FloatArray = np.mean([wheel.centre for wheel in wheels], axis=0)
    return centres - (0.0, 0.0, float(np.mean([wheel.radius for wheel in wheels])))


def _sides(left: list[Wheel], right: list[Wheel]) -> DriveProposal:
    apart = float(np.mean([w.centre[1] for w in left]) - np.mean([w.centre[1] for w in right]))
    wheels = [*left, *right]
    lines = [
        f"left: [{', '.join(wheel.name for wheel in left)}]",
        f"right: [{', '.join(wheel.name for wheel in right)}]",
        f"radius: {wheels[0].radius:g}",
    ]
    if len(left) == 1:
        return DriveProposal("differential", _base(wheels), [*lines, f"separation: {apart:.4g}"])
    wheelbase = float(np.ptp([wheel.centre[0] for wheel in wheels]))
    ratio = min(1.0 + (wheelbase / apart) ** 2, 4.0)
    lines += [
        f"track: {apart:.4g}",
        f"effective_track: {ratio * apart:.4g}    # of four point contacts; calibrate it",
    ]
    after = [f"skid: {{icr_ratio: {ratio:.3g}}}"]
    return DriveProposal("skid_steered", _base(wheels), lines, after)


def _omni(wheels: list[Wheel]) -> DriveProposal:
    base = _base(wheels)
    lines = [f"radius: {wheels[0].radius:g}", "mounts:"]
    for wheel in wheels:
        x, y = (wheel.centre - base)[:2].tolist()
        heading = degrees(atan2(-wheel.axle[0], wheel.axle[1]))  # the axle points to the left
        at = f"[{round(x, 4) + 0.0:g}, {round(y, 4) + 0.0:g}, {heading:.4g} deg]"
        lines.append(f"  - {{joint: {wheel.name}, at: {at}}}")
    return DriveProposal("omni", base, lines, limits=["lateral_speed: 0.5 m/s"])


def _ackermann(model: RobotModel, steered: list[Joint], rear: tuple[Wheel, Wheel]) -> DriveProposal:
    places = {joint.name: model.poses[joint.child][:3, 3] for joint in steered}
    right, left = sorted(places, key=lambda name: float(places[name][1]))
    track = float(rear[0].centre[1] - rear[1].centre[1])
    base = float(np.mean([place[0] for place in places.values()]) - rear[0].centre[0])
    inner = min(abs(_limit(joint, end)) for joint in steered for end in ("lower", "upper"))
    angle = STEERING_RESERVE * atan(base / (base / tan(inner) + track / 2)) if inner else 0.4
    lines = [
        f"steering: [{left}, {right}]",
        f"rear: [{rear[0].name}, {rear[1].name}]",
        f"radius: {rear[0].radius:g}",
        f"wheelbase: {base:.4g}",
        f"track: {track:.4g}",
        f"steering_angle: {degrees(angle):.3g} deg",
        "steering_speed: 2.0 rad/s          # not in the URDF",
    ]
    planner = [
        "navigation:",
        "  planner: hybrid_astar              # plans turns that a car can drive",
    ]
    return DriveProposal("ackermann", _base(list(rear)), lines, planner)


def _limit(joint: Joint, end: str) -> float:
    limit = joint.element.first("limit")
    text = "" if limit is None else limit.attributes.get(end, "")
    try:
        return float(text or 0.0)
    except ValueError:
        return 0.0
