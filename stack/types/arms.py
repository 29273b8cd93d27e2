"""Joints, arms, grippers and blocks: how links are joined, measured states, what is commanded.

Joints stand in the order of the arm's description. A prismatic joint has metres instead of radians
and newtons instead of newton metres.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stack.types.detections import ObjectColour
from stack.types.geometry import FloatArray

AT_REST = 0.02
"""Speed below which a joint stands, rad/s or m/s."""


@dataclass(frozen=True, eq=False, slots=True)
class LinkJoint:
    """How a link of a robot hangs on another one, as the URDF describes it.

    Attributes:
        name: of the joint.
        kind: fixed | revolute | continuous | prismatic.
        parent: name of the link above.
        child: name of the link below, whose frame is that of the joint.
        origin: (4, 4) parent <- child with the joint at 0, metres.
        axis: (3,) unit vector in the joint's frame, about or along which the child moves.
    """

    name: str
    kind: str
    parent: str
    child: str
    origin: FloatArray
    axis: FloatArray


@dataclass(frozen=True, slots=True)
class JointState:
    """Measured state of the joints of an arm.

    Attributes:
        stamp: seconds on the body's clock.
        positions: (n,) radians.
        velocities: (n,) rad/s.
        efforts: (n,) torques of the motors, N m.
        problem: why the arm stopped by itself, as in "joint 4: tracking error 0.2 rad"; empty if
            it did not. It stays until the next trajectory.
    """

    stamp: float
    positions: FloatArray
    velocities: FloatArray
    efforts: FloatArray
    problem: str = ""

    @property
    def speed(self) -> float:
        """Of the fastest joint, rad/s."""
        return float(np.abs(self.velocities).max())

    @property
    def stands(self) -> bool:
        """Whether all joints stand."""
        return self.speed < AT_REST


@dataclass(frozen=True, slots=True)
class GripperState:
    """Measured state of a parallel gripper.

    Attributes:
        stamp: seconds on the body's clock.
        width: distance between the fingers, metres.
        force: with which they press, N.
        moving: whether the fingers move.
    """

    stamp: float
    width: float
    force: float
    moving: bool


@dataclass(frozen=True, slots=True)
class JointTrajectory:
    """A motion of an arm: cubic Hermite pieces between samples.

    The body begins it when it is commanded, ends it at rest, and then holds the last position.

    Attributes:
        times: (k,) seconds since its begin, rising from 0.
        positions: (k, n) radians.
        velocities: (k, n) rad/s; zero in the last row.
    """

    times: FloatArray
    positions: FloatArray
    velocities: FloatArray

    @property
    def duration(self) -> float:
        """Seconds."""
        return float(self.times[-1])


@dataclass(frozen=True, slots=True)
class GripperCommand:
    """Move the fingers of a gripper.

    Attributes:
        width: distance between the fingers, metres.
        force: with which they press at most, N.
    """

    width: float
    force: float


@dataclass(frozen=True, eq=False, slots=True)
class GraspPlan:
    """A way to grasp a block. Poses of the tool are (4, 4) in the arm's base link, metres.

    Attributes:
        name: as in "from above, fingers along y": axes of the block.
        pre_grasp: (n,) positions of the joints in front of the block.
        tool: at the grasp; the way to it is straight.
        lift: after the lift; the way to it is straight.
        width: of the block between the fingers, metres.
        opening: distance between the fingers before they close, metres.
    """

    name: str
    pre_grasp: FloatArray
    tool: FloatArray
    lift: FloatArray
    width: float
    opening: float


@dataclass(frozen=True, eq=False, slots=True)
class PlacePlan:
    """A place for the block in the hand.

    Attributes:
        tool: pose (4, 4) where the fingers open, in the arm's base link, metres.
        way: motion from the begin of the plan to where the block is lowered in a straight line.
    """

    tool: FloatArray
    way: JointTrajectory


@dataclass(frozen=True, eq=False, slots=True)
class Block:
    """A box of one colour that stands on something level.

    Attributes:
        colour: of its surface.
        pose: (4, 4) of its centre in the arm's base link (of a robot without an arm: the base
            frame), metres; x along the longer side, z away from what it stands on. Of a block whose
            sides look equally long, x is within 45 degrees of that of the link.
        size: (3,) along x, y and z, metres.
        covariance: (4, 4) of x, y, z and yaw, metres and radians, in the same frame.
        stamp: of the depth picture, seconds on the body's clock.
        camera: depth camera that has shown it there; empty: a hand or a file has put it there.
    """

    colour: ObjectColour
    pose: FloatArray
    size: FloatArray
    covariance: FloatArray
    stamp: float
    camera: str = ""
