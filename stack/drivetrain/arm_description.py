"""Description of an arm with its gripper, as read from robot.yaml and the URDF."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from stack.types import FloatArray, LinkJoint

HOME = "home"
"""The posture that every arm has: at the start, and while the base drives."""


@dataclass(frozen=True)
class JointLimits:
    """What the joints of an arm can do.

    Attributes:
        lower: (n,) radians.
        upper: (n,) radians.
        velocity: (n,) rad/s.
        acceleration: (n,) rad/s².
        jerk: (n,) rad/s³.
        effort: (n,) N m.
    """

    lower: FloatArray
    upper: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray
    effort: FloatArray


@dataclass(frozen=True)
class GripperDescription:
    """A parallel gripper.

    Attributes:
        joints: prismatic URDF joints of its two fingers; each travels half of the width.
        width_max: distance between the open fingers, metres.
        force_max: N.
        speed: of one finger, m/s.
        finger_links: URDF links that may touch what is held.
    """

    joints: tuple[str, str]
    width_max: float
    force_max: float
    speed: float
    finger_links: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class ArmDescription:
    """An arm with its gripper.

    Attributes:
        joints: names of its URDF joints, from the base to the hand.
        base_link: URDF link that carries the first joint.
        tool_link: URDF link whose frame is moved: between the finger tips, z out of the hand, y
            along the fingers' travel.
        limits: of the joints.
        postures: named positions (n,) of the joints, radians; `home` always exists.
        gripper: None without one.
    """

    joints: tuple[str, ...]
    base_link: str
    tool_link: str
    limits: JointLimits
    postures: Mapping[str, FloatArray] = field(default_factory=dict)
    gripper: GripperDescription | None = None

    @property
    def all_joints(self) -> tuple[str, ...]:
        """The joints of the arm, and those of the gripper's fingers after them."""
        return (*self.joints, *(self.gripper.joints if self.gripper is not None else ()))

    def length_of(self, joint: LinkJoint) -> float:
        """Return how far a joint may take its child from its parent, metres."""
        return float(np.linalg.norm(joint.origin[:3, 3])) + self.travel_of(joint.name, joint.kind)

    def travel_of(self, name: str, kind: str) -> float:
        """Return how far a joint of a kind slides from 0 at most, metres; 0 if it turns."""
        if kind != "prismatic" or name not in self.joints:
            return 0.0
        number = self.joints.index(name)
        return max(abs(float(self.limits.lower[number])), abs(float(self.limits.upper[number])))
