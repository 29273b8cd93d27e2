"""Frames of a robot's links, from its URDF."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import cos, sin
from xml.etree import ElementTree

from stack.errors import InputError

Vector = tuple[float, float, float]
Rotation = tuple[float, float, float, float]
"""Quaternion x, y, z, w."""

MAP, ODOM, BASE = "map", "odom", "base"
"""Frames above the robot's own (REP 105)."""

AT_ORIGIN: Vector = (0.0, 0.0, 0.0)
UNROTATED: Rotation = (0.0, 0.0, 0.0, 1.0)


@dataclass(frozen=True, slots=True)
class LinkFrame:
    """A frame that does not move in its parent.

    Attributes:
        parent: name of the frame in which it stands.
        name: its own.
        position: x, y, z in the parent, metres.
        rotation: in the parent.
    """

    parent: str
    name: str
    position: Vector = AT_ORIGIN
    rotation: Rotation = UNROTATED


def link_frames(urdf: str) -> tuple[LinkFrame, ...]:
    """The frames of all links below BASE, movable joints at zero; none without a URDF.

    A link with the name of one of the frames above it gets `_link` at its end.

    Raises:
        InputError: it is not a URDF.
    """
    try:
        return tuple(_frames(ElementTree.fromstring(urdf))) if urdf else ()
    except (ElementTree.ParseError, ValueError) as error:
        raise InputError(f"the URDF of the recording is damaged: {error}") from None


def rotation_of(angles: Vector) -> Rotation:
    """The rotation by roll, pitch and yaw about fixed axes, radians, as URDF defines them."""
    (cr, sr), (cp, sp), (cy, sy) = ((cos(a / 2.0), sin(a / 2.0)) for a in angles)
    return (
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )


def _frames(robot: ElementTree.Element) -> Iterator[LinkFrame]:
    joints = robot.findall("joint")
    children = {_link(joint, "child") for joint in joints}
    for link in robot.findall("link"):
        name = link.get("name", "")
        if name not in children and name != BASE:
            yield LinkFrame(BASE, _name(name))
    for joint in joints:
        parent, child = _link(joint, "parent"), _link(joint, "child")
        origin = joint.find("origin")
        at = {} if origin is None else origin.attrib
        yield LinkFrame(
            parent if parent == BASE and BASE not in children else _name(parent),
            _name(child),
            _vector(at.get("xyz", "")),
            rotation_of(_vector(at.get("rpy", ""))),
        )


def _name(link: str) -> str:
    return f"{link}_link" if link in (MAP, ODOM, BASE) else link


def _link(joint: ElementTree.Element, role: str) -> str:
    found = joint.find(role)
    return "" if found is None else found.get("link", "")


def _vector(text: str) -> Vector:
    x, y, z = map(float, text.split() or "000")
    return x, y, z
