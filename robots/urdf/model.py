"""The tree of links and joints of a URDF: where each link is, and what it weighs.

Frames follow the URDF: a joint's frame is its child's frame at angle 0; the root link's frame is
that of the whole model. Transforms are (4, 4) arrays, metres.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from math import cos, sin

import numpy as np

from robots.declared import URDF
from stack.documents import Findings
from stack.documents.xml_file import Element
from stack.geometry.rotations import from_angles
from stack.types import FloatArray, LinkJoint

TURNING = ("continuous", "revolute")
KINDS = (*TURNING, "fixed", "prismatic")


@dataclass(frozen=True)
class Inertial:
    """Mass, kg, centre of mass (3,) and inertia tensor (3, 3) about it, kg m², in some frame."""

    mass: float
    centre: FloatArray
    inertia: FloatArray

    def moved(self, transform: FloatArray) -> Inertial:
        """The same body in another frame, given the transform from its own."""
        turn, shift = transform[:3, :3], transform[:3, 3]
        return Inertial(self.mass, turn @ self.centre + shift, turn @ self.inertia @ turn.T)


@dataclass(frozen=True)
class Joint:
    """A joint: its element, type, names of the links, origin (4, 4) and axis in its frame (3,)."""

    element: Element
    kind: str
    parent: str
    child: str
    origin: FloatArray
    axis: FloatArray

    @property
    def name(self) -> str:
        """Its name."""
        return self.element.name


class RobotModel:
    """Links and joints of a URDF, which form one tree.

    Attributes:
        links: elements by name, in the file's order.
        joints: by name, in the file's order.
        root: name of the link without parent.
    """

    def __init__(self, root: Element) -> None:
        """Read the tree.

        Raises:
            InputError: names are used twice or unknown, or the links do not form one tree.
        """
        findings = Findings()
        self.element = root
        self.links = _by_name(root, "link", findings)
        elements = _by_name(root, "joint", findings)
        read = [_joint(element, self.links, findings) for element in elements.values()]
        self.joints = {joint.name: joint for joint in read if joint is not None}
        findings.raise_errors()
        self._above: dict[str, Joint] = {}
        for joint in self.joints.values():
            if joint.child in self._above:
                other = self._above[joint.child].name
                sentence = f"the link {joint.child!r} is the child of two joints, {other!r} and "
                findings.add(URDF, joint.element.mark, f"{sentence}{joint.name!r}")
            self._above[joint.child] = joint
        findings.raise_errors()  # the tree below a link ends only if each has one parent
        self.root = self._root(findings)
        findings.raise_errors()

    @cached_property
    def poses(self) -> dict[str, FloatArray]:
        """Pose of each link in the root's frame, with all joints at 0."""
        return self.posed({})

    def posed(self, positions: Mapping[str, float]) -> dict[str, FloatArray]:
        """Return the pose of each link in the root's frame.

        Args:
            positions: of joints by name, radians or metres; others are at 0.
        """
        poses: dict[str, FloatArray] = {self.root: np.eye(4)}
        for joint in self.downwards(self.root):
            moved = _moved(joint, positions.get(joint.name, 0.0))
            poses[joint.child] = poses[joint.parent] @ joint.origin @ moved
        return poses

    @cached_property
    def _below(self) -> dict[str, list[Joint]]:
        found: dict[str, list[Joint]] = {name: [] for name in self.links}
        for joint in self.joints.values():
            found[joint.parent].append(joint)
        return found

    def joint_above(self, link: str) -> Joint | None:
        """The joint whose child a link is; None of the root."""
        return self._above.get(link)

    def joints_above(self, link: str) -> list[Joint]:
        """The joints from the root to a link."""
        found: list[Joint] = []
        joint = self.joint_above(link)
        while joint is not None:
            found.append(joint)
            joint = self.joint_above(joint.parent)
        return found[::-1]

    def turns(self, link: str) -> bool:
        """Whether a link is on a continuous joint, or on something that is."""
        return any(joint.kind == "continuous" for joint in self.joints_above(link))

    def joints_below(self, link: str) -> list[Joint]:
        """The joints whose parent a link is."""
        return self._below[link]

    def downwards(self, link: str) -> Iterator[Joint]:
        """All joints below a link, parents first."""
        for joint in self._below[link]:
            yield joint
            yield from self.downwards(joint.child)

    def links_below(self, base: str, origin: FloatArray) -> tuple[LinkJoint, ...]:
        """The joints between a base frame and all links, parents first.

        Args:
            base: name of the base frame; a root link of this name is the base frame itself.
            origin: (3,) of the base frame in the root's frame, metres; it is not turned.
        """
        shift = np.eye(4)
        shift[:3, 3] = -origin
        under = base if self.root == base else self.root
        above = () if under == base else (
            LinkJoint(f"{base}_to_{under}", "fixed", base, under, shift, np.zeros(3)),
        )  # fmt: skip
        below = (
            LinkJoint(
                joint.name, joint.kind, joint.parent, joint.child,
                shift @ joint.origin if joint.parent == base == self.root else joint.origin,
                joint.axis,
            )
            for joint in self.downwards(self.root)
        )  # fmt: skip
        return (*above, *below)

    def axis_of(self, joint: Joint) -> FloatArray:
        """The axis (3,) of a joint in the root's frame."""
        axis: FloatArray = self.poses[joint.child][:3, :3] @ joint.axis
        return axis

    def mass_below(self, link: str) -> float:
        """Mass, kg, of a link and everything below it."""
        return self.mass_of(link) + sum(self.mass_of(joint.child) for joint in self.downwards(link))

    def mass_of(self, link: str) -> float:
        """Mass of a link, kg; 0 without <inertial>, as in Gazebo."""
        inertial = inertial_of(self.links[link])
        return 0.0 if inertial is None else inertial.mass

    @property
    def mass(self) -> float:
        """Mass of the whole robot, kg."""
        return self.mass_below(self.root)

    def _root(self, findings: Findings) -> str:
        """The link without parent; reports other ones, and loops."""
        tops = [name for name in self.links if name not in self._above]
        for first, second in pairwise(tops):
            sentence = (
                f"the links do not form one tree: neither {first!r} nor {second!r} is the child of "
                "a joint"
            )
            findings.add(URDF, self.links[second].mark, sentence, "connect them by a joint")
        root = next(iter(tops), "")
        reached = {root} | ({joint.child for joint in self.downwards(root)} if root else set())
        for name, element in self.links.items():
            if name not in reached and len(tops) < 2:
                sentence = f"the joints above the link {name!r} form a loop"
                findings.add(URDF, element.mark, sentence)
                break
        if not self.links:
            findings.add(URDF, self.element.mark, "the URDF has no <link>")
        return root


def _moved(joint: Joint, position: float) -> FloatArray:
    """The transform (4, 4) that a joint's position makes, by the formula of Rodrigues."""
    matrix = np.eye(4)
    if joint.kind == "prismatic":
        matrix[:3, 3] = position * joint.axis
    elif joint.kind in TURNING and position:
        x, y, z = joint.axis
        cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        matrix[:3, :3] += sin(position) * cross + (1.0 - cos(position)) * cross @ cross
    return matrix


def _by_name(root: Element, tag: str, findings: Findings) -> dict[str, Element]:
    """The children of <robot> with this tag; those of other elements refer to them."""
    found: dict[str, Element] = {}
    for element in root.all(tag):
        if not element.name:
            findings.add(URDF, element.mark, f"a <{tag}> has no name")
        elif element.name in found:
            findings.add(URDF, element.mark, f"two {tag}s are named {element.name!r}")
        else:
            found[element.name] = element
    return found


def _joint(element: Element, links: dict[str, Element], findings: Findings) -> Joint | None:
    ends = []
    for tag in ("parent", "child"):
        end = element.first(tag)
        name = "" if end is None else end.attributes.get("link", "")
        ends.append(name)
        if name not in links:
            sentence = f"the joint {element.name!r} has no <{tag} link=…>"
            if name:
                sentence = f"the {tag} of the joint {element.name!r}, {name!r}, is not a link"
            findings.add(URDF, element.mark, sentence)
            return None
    kind = element.attributes.get("type", "")
    if kind not in KINDS:
        sentence = f"the joint {element.name!r} is of type {kind!r}, expected {', '.join(KINDS)}"
        findings.add(URDF, element.mark, sentence)
        return None
    axis = _three(element.first("axis"), "xyz", (1.0, 0.0, 0.0))
    length = float(np.linalg.norm(axis))
    if length < 1e-6 and kind != "fixed":
        findings.add(URDF, element.mark, f"the axis of the joint {element.name!r} is 0 0 0")
        return None
    return Joint(element, kind, ends[0], ends[1], origin_of(element), axis / max(length, 1e-6))


def origin_of(element: Element) -> FloatArray:
    """The transform (4, 4) of the <origin> in an element; identity without one."""
    origin = element.first("origin")
    position, angles = (_three(origin, name, (0.0, 0.0, 0.0)) for name in ("xyz", "rpy"))
    return from_angles(position, angles.tolist())


def inertial_of(link: Element) -> Inertial | None:
    """The inertial part of a link in its frame; None without one."""
    inertial = link.first("inertial")
    mass = None if inertial is None else inertial.first("mass")
    if inertial is None or mass is None:
        return None
    origin, inertia = origin_of(inertial), inertial.first("inertia")
    given = {} if inertia is None else inertia.attributes
    ixx, iyy, izz, ixy, ixz, iyz = (
        float(given.get(key, 0.0)) for key in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    )
    tensor = np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])
    turn = origin[:3, :3]
    return Inertial(float(mass.attributes["value"]), origin[:3, 3], turn @ tensor @ turn.T)


def combined(parts: list[Inertial]) -> Inertial:
    """Several rigidly connected bodies as one, in their common frame (parallel axis theorem)."""
    mass = sum(part.mass for part in parts)
    if mass == 0.0:
        return Inertial(0.0, np.zeros(3), np.zeros((3, 3)))
    centre = sum((part.mass * part.centre for part in parts), np.zeros(3)) / mass
    inertia = np.zeros((3, 3))
    for part in parts:
        away = part.centre - centre
        inertia += part.inertia + part.mass * (away @ away * np.eye(3) - np.outer(away, away))
    return Inertial(mass, centre, inertia)


def _three(element: Element | None, name: str, default: tuple[float, ...]) -> FloatArray:
    text = "" if element is None else element.attributes.get(name, "")
    return np.array([float(word) for word in text.split()] or default)
