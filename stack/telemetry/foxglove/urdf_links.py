"""Frames and shapes of a robot's links, from its URDF."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
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

GREY: Vector = (0.6, 0.62, 0.66)
"""Colour of shapes without a material."""


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


@dataclass(frozen=True, slots=True)
class LinkShape:
    """A visible shape of a link.

    Attributes:
        frame: of the link.
        kind: box | cylinder | sphere.
        size: length, width, height; of round shapes the diameters; metres.
        position: of its centre in the frame, metres.
        rotation: in the frame.
        colour: red, green, blue in [0, 1].
    """

    frame: str
    kind: str
    size: Vector
    position: Vector
    rotation: Rotation
    colour: Vector


@dataclass(frozen=True, slots=True)
class Links:
    """The links of a robot. Movable joints are at zero; meshes are left out.

    Attributes:
        frames: below BASE. A link with the name of a frame above it gets `_link` at its end.
        shapes: boxes, cylinders and spheres.
    """

    frames: tuple[LinkFrame, ...] = ()
    shapes: tuple[LinkShape, ...] = ()


def links_of(urdf: str) -> Links:
    """The links of a URDF; none without one.

    Raises:
        InputError: it is not a URDF.
    """
    if not urdf:
        return Links()
    try:
        robot = ElementTree.fromstring(urdf)
        names = _frame_names(robot)
        return Links(tuple(_frames(robot, names)), tuple(_shapes(robot, names)))
    except (ElementTree.ParseError, LookupError, ValueError) as error:
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


def _frame_names(robot: ElementTree.Element) -> dict[str, str]:
    """The frame of each link; only a root may be BASE itself."""
    children = {_named(joint, "child") for joint in robot.findall("joint")}
    taken = {MAP, ODOM, BASE} if BASE in children else {MAP, ODOM}
    links = [link.get("name", "") for link in robot.findall("link")]
    return {name: f"{name}_link" if name in taken else name for name in links}


def _frames(robot: ElementTree.Element, names: Mapping[str, str]) -> Iterator[LinkFrame]:
    joints = robot.findall("joint")
    children = {_named(joint, "child") for joint in joints}
    for link, frame in names.items():
        if link not in children and frame != BASE:
            yield LinkFrame(BASE, frame)
    for joint in joints:
        parent, child = names[_named(joint, "parent")], names[_named(joint, "child")]
        yield LinkFrame(parent, child, *_origin(joint))


def _shapes(robot: ElementTree.Element, names: Mapping[str, str]) -> Iterator[LinkShape]:
    palette = {item.get("name"): _colour(item) for item in robot.findall("material")}
    for link in robot.findall("link"):
        for visual in link.findall("visual"):
            material = visual.find("material")
            own = None if material is None else _colour(material)
            shared = None if material is None else palette.get(material.get("name"))
            for kind, size in _solids(visual):
                frame, colour = names[link.get("name", "")], own or shared or GREY
                yield LinkShape(frame, kind, size, *_origin(visual), colour)


def _solids(visual: ElementTree.Element) -> Iterator[tuple[str, Vector]]:
    """Kind and size of a visual that is no mesh."""
    for shape in visual.iterfind("geometry/*"):
        width = 2.0 * float(shape.get("radius", "0"))
        if shape.tag == "box":
            yield "box", _vector(shape.get("size", ""))
        elif shape.tag == "cylinder":
            yield "cylinder", (width, width, float(shape.get("length", "0")))
        elif shape.tag == "sphere":
            yield "sphere", (width, width, width)


def _colour(material: ElementTree.Element) -> Vector | None:
    found = material.find("color")
    if found is None:
        return None
    red, green, blue, _ = map(float, found.get("rgba", "").split())
    return red, green, blue


def _origin(element: ElementTree.Element) -> tuple[Vector, Rotation]:
    found = element.find("origin")
    at = {} if found is None else found.attrib
    return _vector(at.get("xyz", "")), rotation_of(_vector(at.get("rpy", "")))


def _named(joint: ElementTree.Element, role: str) -> str:
    found = joint.find(role)
    return "" if found is None else found.get("link", "")


def _vector(text: str) -> Vector:
    x, y, z = map(float, text.split() or "000")
    return x, y, z
