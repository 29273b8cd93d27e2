"""What displays show of an arm: its links, its way, grasps, and what is around it."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from stack.frames.tree import lifted
from stack.navigation.capabilities.arm import StackArm
from stack.navigation.capabilities.gripper import GRIPPER
from stack.navigation.capabilities.limbs import ArmStage
from stack.navigation.capabilities.motion_watch import JOINTS
from stack.telemetry.records import AROUND_ARM, Layer, SceneShape
from stack.types import (
    ArmView,
    FloatArray,
    GripperState,
    HeldBlock,
    JointState,
    JointTrajectory,
    ObjectColour,
    Perceived,
    Pose2D,
    on_floor,
)

POINTS = 40
"""Of the drawn way of the tool."""

BOX_COLOUR = (0.42, 0.46, 0.52)
BLOCK_COLOURS: Mapping[ObjectColour, tuple[float, float, float]] = MappingProxyType({
    "red": (0.90, 0.25, 0.20), "yellow": (0.95, 0.80, 0.20), "green": (0.25, 0.75, 0.35),
    "blue": (0.25, 0.45, 0.95),
})  # fmt: skip


class ArmDisplay:
    """Composes what displays show of the arm of a robot; of one without, nothing.

    Args:
        limbs: of the robot.
    """

    def __init__(self, limbs: ArmStage) -> None:
        self._limbs = limbs
        self._drawn: tuple[JointTrajectory | None, FloatArray] = (None, np.zeros((0, 3)))
        self._around, self._shown = Layer(0, ()), (0, Pose2D(0.0, 0.0))

    def view(self, perceived: Perceived) -> ArmView | None:
        """Return the state of the arm; None without one, or before its first joints."""
        arm, joints = self._limbs.arm, perceived.newest(JOINTS, JointState)
        if arm is None or joints is None:
            return None
        links = self._links(arm, joints.positions)
        tool, limits = links[-1], arm.description.limits
        grasps = [arm.base_from_link @ grasp.tool for grasp in arm.grasps]
        block = arm.held
        held = None if block is None else HeldBlock(
            arm.base_from_link @ block.pose, block.size, BLOCK_COLOURS[block.colour]
        )  # fmt: skip
        gripper, described = perceived.newest(GRIPPER, GripperState), arm.description.gripper
        width, open_width, force, fingers = 0.0, 0.0, 0.0, {}
        if gripper is not None and described is not None:
            width, open_width, force = gripper.width, described.width_max, gripper.force
            fingers = dict.fromkeys(described.joints, width / 2.0)
        return ArmView(
            arm.joint_names, joints.positions, limits.lower, limits.upper,
            not self._limbs.is_standing(perceived), tool, joints.problem,
            width, open_width, force, joints.speed, fingers,
            np.array([pose[:3, 3] for pose in links]), self._way(arm),
            np.array(grasps).reshape(-1, 4, 4), held,
        )  # fmt: skip

    def layers(self, map_from_odom: Pose2D) -> dict[str, Layer]:
        """Return what is around the arm, map frame, as a layer by name; nothing without an arm.

        Args:
            map_from_odom: pose of the odom frame in the map frame.
        """
        arm = self._limbs.arm
        if arm is None:
            return {}
        wanted = arm.around.version, map_from_odom
        if wanted != self._shown:
            self._shown = wanted
            odom = lifted(map_from_odom)
            boxes = [_shape(pose, size, BOX_COLOUR) for pose, size in arm.around.boxes]
            blocks = [
                _shape(odom @ block.pose, block.size, BLOCK_COLOURS[block.colour])
                for block in arm.around.blocks.values()
            ]
            self._around = Layer(self._around.version + 1, (*boxes, *blocks))
        return {AROUND_ARM: self._around}

    def _links(self, arm: StackArm, positions: FloatArray) -> list[FloatArray]:
        """Poses (4, 4) of the links from the base to the tool, base frame."""
        described = arm.description
        chain = arm.links.joints_to(described.tool_link)
        first = next(n for n, joint in enumerate(chain) if joint.name == described.joints[0])
        by_name = dict(zip(arm.joint_names, positions.tolist(), strict=True))
        names = [described.base_link, *(joint.child for joint in chain[first:])]
        return [arm.links.pose(name, by_name) for name in names]

    def _way(self, arm: StackArm) -> FloatArray:
        """The way (n, 3) of the tool in the motion that goes on, base frame."""
        motion = arm.motion
        if motion is not self._drawn[0]:
            self._drawn = motion, _points(arm, motion)
        return self._drawn[1]


def _points(arm: StackArm, motion: JointTrajectory | None) -> FloatArray:
    if motion is None:
        return np.zeros((0, 3))
    rows = np.linspace(0, len(motion.times) - 1, min(POINTS, len(motion.times))).round().astype(int)
    chain = arm.links.chain(arm.description.tool_link)
    order = [arm.joint_names.index(name) for name in chain.names]
    return np.array([chain.pose(motion.positions[row, order])[:3, 3] for row in rows])


def _shape(pose: FloatArray, size: FloatArray, colour: tuple[float, float, float]) -> SceneShape:
    """A level box with its centre at a pose (4, 4), map frame."""
    length, width, height = size.tolist()
    lift = float(pose[2, 3]) - height / 2.0
    return SceneShape("box", on_floor(pose), (length, width, height), colour, lift)
