"""Model of an arm for planning: joints, links and collision shapes, from the URDF.

All joints but those of the arm and of its gripper are locked at their zero position. Poses are in
the arm's `base_link`. Meshes become their convex hulls: contacts of hulls are some ten times
cheaper, and a hull contains its mesh, so that a pose that is free for hulls is free.

Which links may meet is found by sampling, not listed by hand: pairs that a joint connects, and
pairs that touch in nearly all of the sampled poses (hulls of neighbours but one overlap), cannot
be contacts.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from stack.drivetrain.arm_description import ArmDescription
from stack.drivetrain.description import BASE
from stack.errors import InputError
from stack.optional_packages import PINOCCHIO
from stack.streams import stream
from stack.types import FloatArray, LinkJoint

SAMPLES = 400
"""Poses of the search for pairs of links that always touch."""

SELF_CLEARANCE = 0.002
"""Metres that a link keeps to another; pairs that are always nearer are no contacts."""

ALWAYS = 0.95
"""Share of the sampled poses from which on a pair is considered to touch always."""


class ArmModel:
    """An arm with its gripper.

    Attributes:
        description: names, limits and postures.
        model: of Pinocchio, with the joints of the arm and the gripper only.
        geometry: of Pinocchio: convex shapes of the robot.
        tool: index of the tool's frame.
        base: (4, 4) from the URDF's root to `base_link`.
        columns: (n,) of the arm's joints in Jacobians.
        moving: indices of shapes that the arm moves.
        self_pairs: indices of pairs of shapes that may touch.
        reach: (n,) metres that a point of the arm moves at most per radian of a joint; 1 for
            prismatic joints.
    """

    def __init__(
        self,
        urdf: str | Path,
        description: ArmDescription,
        folders: Sequence[Path] = (),
        links: Sequence[LinkJoint] = (),
    ) -> None:
        """Read the arm.

        Args:
            urdf: the path of the file, or its text.
            description: of the arm.
            folders: in which `package://NAME/…` is NAME; that of the file is one of them.
            links: of the robot below its base frame, parents first, for the URDF of a simulation:
                it has the base frame as its root, leaves links without mass out, and fixes joints
                that nothing drives.

        Raises:
            InputError: Pinocchio is not installed, the URDF cannot be read, or it lacks a joint or
                link of the description.
        """
        PINOCCHIO.require("planning for an arm needs")
        import pinocchio

        self.pin: Any = pinocchio
        self.description = description
        name, text, places = _source(urdf, folders)
        try:
            whole = pinocchio.buildModelFromXML(text)
            shapes = pinocchio.buildGeomFromUrdfString(
                whole, text, pinocchio.GeometryType.COLLISION, package_dirs=places
            )
        except (ValueError, RuntimeError) as error:
            raise InputError(f"{name} cannot be read: {error}") from error
        self._place(whole, links)
        self._require(name, whole)
        fingers = description.gripper.joints if description.gripper else ()
        locked = [
            whole.getJointId(joint)
            for joint in whole.names[1:]
            if joint not in {*description.joints, *fingers}
        ]
        self.model, self.geometry = pinocchio.buildReducedModel(
            whole, shapes, locked, pinocchio.neutral(whole)
        )
        _make_convex(self.geometry)
        self.tool: int = self.model.getFrameId(description.tool_link)
        self._neutral = pinocchio.neutral(self.model)
        self._slots = self._slots_of(description.joints)
        self._finger_slots = self._slots_of(fingers)
        self.columns = np.array(
            [self.model.joints[self._id(joint)].idx_v for joint in description.joints]
        )
        data = self.model.createData()
        pinocchio.framesForwardKinematics(self.model, data, pinocchio.neutral(self.model))
        self.base: FloatArray = data.oMf[
            self.model.getFrameId(description.base_link)
        ].homogeneous.copy()
        self.moving = [
            index
            for index, shape in enumerate(self.geometry.geometryObjects)
            if shape.parentJoint > 0
        ]
        self.reach = self._reach()
        self.self_pairs = self._self_pairs()

    def _place(self, whole: Any, links: Sequence[LinkJoint]) -> None:
        """Put the frames of all links where the robot has them."""
        places = {BASE: (0, self.pin.SE3.Identity())}
        for joint in links:
            parent, place = places[joint.parent]
            place = place * self.pin.SE3(joint.origin)
            if joint.kind != "fixed" and whole.existJointName(joint.name):
                parent, place = whole.getJointId(joint.name), self.pin.SE3.Identity()
            places[joint.child] = parent, place
            if whole.existFrame(joint.child):
                whole.frames[whole.getFrameId(joint.child)].placement = place
            else:
                kind = self.pin.FrameType.OP_FRAME
                whole.addFrame(self.pin.Frame(joint.child, parent, place, kind))

    def configuration(self, positions: FloatArray, width: float | None = None) -> FloatArray:
        """Return Pinocchio's configuration.

        Args:
            positions: (n,) of the arm's joints.
            width: between the fingers, metres; None: open.
        """
        configuration: FloatArray = self._neutral.copy()
        for (start, is_continuous), position in zip(self._slots, positions, strict=True):
            if is_continuous:
                configuration[start : start + 2] = np.cos(position), np.sin(position)
            else:
                configuration[start] = position
        gripper = self.description.gripper
        if gripper is not None:
            half = (gripper.width_max if width is None else width) / 2.0
            for start, _ in self._finger_slots:
                configuration[start] = half
        return configuration

    def link_of(self, shape: int) -> str:
        """Return the link of a shape of the robot."""
        frame = self.geometry.geometryObjects[shape].parentFrame
        return str(self.model.frames[frame].name)

    def _require(self, name: str, whole: Any) -> None:
        description = self.description
        fingers = description.gripper.joints if description.gripper else ()
        links = [frame.name for frame in whole.frames]
        for kind, wanted, known in (
            ("joint", (*description.joints, *fingers), list(whole.names[1:])),
            ("link", (description.base_link, description.tool_link), links),
        ):
            for word in wanted:
                if word not in known:
                    raise InputError(
                        f"{name} has no {kind} {word!r} that the arm names",
                        f"its moving joints: {', '.join(known)}" if kind == "joint" else "",
                    )

    def _id(self, joint: str) -> int:
        return int(self.model.getJointId(joint))

    def _slots_of(self, joints: Sequence[str]) -> list[tuple[int, bool]]:
        """Return where each joint begins in a configuration, and whether it turns without end."""
        parts = [self.model.joints[self._id(joint)] for joint in joints]
        return [(part.idx_q, part.nq == 2) for part in parts]

    def _reach(self) -> FloatArray:
        """Bound the motion per joint by the lengths of the links beyond it and their shapes."""
        size = np.zeros(self.model.njoints)
        for shape in self.geometry.geometryObjects:
            shape.geometry.computeLocalAABB()
            centre = shape.placement.act(shape.geometry.aabb_center)
            radius = float(np.linalg.norm(centre)) + shape.geometry.aabb_radius
            size[shape.parentJoint] = max(size[shape.parentJoint], radius)
        size = np.maximum(size, self._tool_size())
        beyond = size.copy()
        for joint in range(self.model.njoints - 1, 0, -1):
            parent = self.model.parents[joint]
            length = float(np.linalg.norm(self.model.jointPlacements[joint].translation))
            beyond[parent] = max(beyond[parent], length + self._travel(joint) + beyond[joint])
        ids = [self._id(joint) for joint in self.description.joints]
        return np.array([1.0 if self._is_prismatic(joint) else beyond[joint] for joint in ids])

    def _tool_size(self) -> FloatArray:
        size = np.zeros(self.model.njoints)
        frame = self.model.frames[self.tool]
        size[frame.parentJoint] = float(np.linalg.norm(frame.placement.translation))
        return size

    def _is_prismatic(self, joint: int) -> bool:
        return "JointModelP" in self.model.joints[joint].shortname()

    def _travel(self, joint: int) -> float:
        if not self._is_prismatic(joint):
            return 0.0
        index = self.model.joints[joint].idx_q
        bounds = (self.model.lowerPositionLimit[index], self.model.upperPositionLimit[index])
        return float(max(map(abs, bounds)))

    def _self_pairs(self) -> list[tuple[int, int]]:
        shapes = self.geometry.geometryObjects
        joints = [shape.parentJoint for shape in shapes]
        fingers = {self._id(joint) for joint in self._finger_names()}
        pairs = [
            (first, second)
            for first in range(len(shapes))
            for second in range(first + 1, len(shapes))
            if joints[first] != joints[second]
            and joints[first] != self.model.parents[joints[second]]
            and joints[second] != self.model.parents[joints[first]]
            and not {joints[first], joints[second]} <= fingers
        ]
        geometry = self.geometry.copy()
        geometry.removeAllCollisionPairs()
        for first, second in pairs:
            geometry.addCollisionPair(self.pin.CollisionPair(first, second))
        touching = np.zeros(len(pairs))
        data, results = self.model.createData(), geometry.createData()
        for request in results.collisionRequests:
            request.security_margin = SELF_CLEARANCE
        limits = self.description.limits
        generator = stream(0, "self collision")
        for _ in range(SAMPLES):
            q = self.configuration(generator.uniform(limits.lower, limits.upper))
            self.pin.computeCollisions(self.model, data, geometry, results, q, False)
            touching += [result.isCollision() for result in results.collisionResults]
        return [
            pair for pair, count in zip(pairs, touching, strict=True) if count < ALWAYS * SAMPLES
        ]

    def _finger_names(self) -> tuple[str, ...]:
        return self.description.gripper.joints if self.description.gripper else ()


def _source(urdf: str | Path, folders: Sequence[Path]) -> tuple[str, str, list[str]]:
    """Return a name for messages, the text, and where meshes are."""
    if not isinstance(urdf, Path):
        return "the arm's URDF", urdf, [str(folder) for folder in folders]
    try:
        text = urdf.read_text("utf-8")
    except (OSError, UnicodeError) as error:
        raise InputError(f"{urdf} cannot be read: {error}") from error
    return str(urdf), text, [str(folder) for folder in (*folders, urdf.parent)]


def _make_convex(geometry: Any) -> None:
    import coal

    for shape in geometry.geometryObjects:
        if isinstance(shape.geometry, coal.BVHModelBase):
            shape.geometry.buildConvexHull(True, "Qt")
            shape.geometry = shape.geometry.convex
