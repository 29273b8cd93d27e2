"""Poses of SDF elements, as Euler angles or quaternions, and the frames they refer to."""

from __future__ import annotations

from collections.abc import Iterable
from math import isfinite, radians

import numpy as np

from stack.documents import Findings
from stack.documents.xml_file import Element
from stack.geometry.rotations import from_angles, from_quaternion
from stack.sim.worlds.values import SHAPE
from stack.types import FloatArray

FRAMES = ("frame", "link", "model", "include")
"""Elements that define a frame of their name."""


class UnknownFrame(Exception):
    """A pose refers to a frame that does not exist, or to itself through other frames."""


def numbers(
    findings: Findings, element: Element | None, count: int, code: str = SHAPE
) -> FloatArray | None:
    """The numbers in an element's text, (count,); None if absent, or wrong and reported."""
    if element is None:
        return None
    words = element.text.split()
    try:
        values = [float(word) for word in words]
    except ValueError:
        values = []
    if len(values) != count or not all(map(isfinite, values)):
        wanted = "a number" if count == 1 else f"{count} numbers"
        shown = element.text if len(element.text) <= 60 else element.text[:57] + "..."
        sentence = f"<{element.tag}>: expected {wanted}, got {shown!r}"
        findings.add(code, element.mark, sentence)
        return None
    return np.array(values)


def read_pose(findings: Findings, pose: Element, code: str = SHAPE) -> FloatArray | None:
    """Read the transform (4, 4) of a <pose> element, in the frame that it refers to.

    Args:
        findings: receives errors.
        pose: the element.
        code: of these errors.
    """
    if not pose.text:
        return np.eye(4)
    if pose.attributes.get("rotation_format", "euler_rpy") == "quat_xyzw":
        values = numbers(findings, pose, 7, code)
        if values is not None and float(np.linalg.norm(values[3:])) < 1e-6:
            findings.add(code, pose.mark, "<pose>: the quaternion 0 0 0 0 is not a rotation")
            return None
        return None if values is None else from_quaternion(values[:3], values[3:].tolist())
    values = numbers(findings, pose, 6, code)
    if values is None:
        return None
    angles = values[3:].tolist()
    if pose.attributes.get("degrees") in ("1", "true"):
        angles = [radians(angle) for angle in angles]
    return from_angles(values[:3], angles)


class Frames:
    """The named frames of a model or world, expressed in the frame of that model or world."""

    def __init__(self, findings: Findings, inside: Iterable[Element]) -> None:
        self._findings = findings
        self._named: dict[str, Element] = {}
        for element in inside:
            name = element.text_of("name") if element.tag == "include" else element.name
            if element.tag in FRAMES and name:
                self._named.setdefault(name, element)

    def pose(
        self, element: Element, default: FloatArray, seen: tuple[str, ...] = ()
    ) -> FloatArray | None:
        """Pose (4, 4) of an element in the frame of the model or world.

        Args:
            element: with or without a <pose>.
            default: (4, 4) pose of its parent element in the frame of the model.
            seen: frames already followed, to detect a cycle.

        Returns:
            The pose; None if its <pose> is wrong, which is reported.

        Raises:
            UnknownFrame: it refers to a frame that does not exist.
        """
        pose = element.first("pose")
        frame = "" if pose is None else pose.attributes.get("relative_to", "")
        if not frame and pose is not None:
            frame = pose.attributes.get("frame", "")  # before version 1.7
        if not frame and element.tag == "frame":
            frame = element.attributes.get("attached_to", "")
        origin = default if not frame else self.of(frame, seen)
        if pose is None or origin is None:
            return origin
        own = read_pose(self._findings, pose)
        return None if own is None else origin @ own

    def of(self, name: str, seen: tuple[str, ...] = ()) -> FloatArray | None:
        """Pose (4, 4) of a named frame; None if its <pose> is wrong, which is reported.

        Raises:
            UnknownFrame: there is no such frame, or it refers to itself.
        """
        if name in ("world", "__model__"):
            return np.eye(4)
        if name not in self._named or name in seen:
            raise UnknownFrame(name)
        return self.pose(self._named[name], np.eye(4), (*seen, name))
