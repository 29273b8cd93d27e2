"""Arm and gripper of the robot, for behaviours."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Protocol

from stack.robot.task import Task
from stack.types import (
    Block,
    FloatArray,
    GraspPlan,
    GripperState,
    JointState,
    JointTrajectory,
    PlacePlan,
)


class GraspTask(Task, Protocol):
    """A search for grasps of a block."""

    @property
    def grasps(self) -> tuple[GraspPlan, ...]:
        """The grasps, the best first; none before the end."""


class PlaceTask(Task, Protocol):
    """A search for a place for the block in the hand."""

    @property
    def place(self) -> PlacePlan | None:
        """The first one to which all motions are free; None before the end, and without one."""


class Arm(Protocol):
    """The arm of the robot: joints, motions, and what the arm must not touch.

    Poses are (4, 4) in the arm's base link, metres. Motions to a goal are planned without contact
    once the arm stands: with the boxes of the world, the blocks of `see` and what the hand holds.
    They fail with UNREACHABLE, NO_MOTION_PLAN, START_OCCUPIED, GOAL_OCCUPIED or COLLISION_AHEAD if
    there is no motion, with ARM_COLLISION if the arm stops by itself, and with NO_PROGRESS if arm
    and base do not stand before it, or if it does not arrive.
    """

    @property
    def joint_names(self) -> tuple[str, ...]:
        """URDF names of the joints, from the base to the hand."""

    @property
    def postures(self) -> Mapping[str, FloatArray]:
        """Named positions (n,) of the joints, radians; `home` is always one."""

    @property
    def joints(self) -> JointState | None:
        """The newest measurement; None before the first one."""

    @property
    def tool_pose(self) -> FloatArray | None:
        """Measured pose of the tool; None as for `joints`."""

    @property
    def camera_in_tool(self) -> FloatArray | None:
        """Pose of the optical frame of the camera in the hand in the tool; None without one.

        It is the colour camera, or else the first depth camera, on a link that moves with the tool.
        """

    @property
    def blocks(self) -> Mapping[str, Block]:
        """The blocks around the arm by name, as `see` and `release` have left them."""

    @property
    def held(self) -> Block | None:
        """The block in the hand, where it is now; None without one."""

    def box(self, name: str) -> tuple[FloatArray, FloatArray]:
        """Return pose and size (3,) of a box of the world.

        Raises:
            ParameterError: there is none.
        """

    def see(self, blocks: Iterable[Block], gone: Iterable[Block] = ()) -> tuple[Block, ...]:
        """Take what a look around has shown.

        A known block stays known, unless it is gone or a new one is at its place: it may be hidden.

        Args:
            blocks: that were found.
            gone: known ones that are not at their places any more.

        Returns:
            Those that were found, without the one in the hand and without parts of boxes.
        """

    def hold(self, block: Block, width: float) -> None:
        """The hand has grasped a block; it moves with the tool.

        Args:
            block: from its place before the grasp.
            width: between the fingers, metres.
        """

    def release(self, *, lost: bool = False) -> None:
        """The hand holds nothing any more: its block stands where the tool is, or is lost."""

    def tell(self, did: str, text: str, **fields: float | str) -> None:
        """Show the operator what the arm has done; recorded in the event log.

        Args:
            did: a word: found, picks, picked, placed or lost.
            text: a sentence.
            fields: numbers of it.
        """

    def move_joints(self, positions: FloatArray, *, speed: float = 1.0) -> Task:
        """Move the joints to positions.

        Args:
            positions: (n,) radians.
            speed: share of the top speed.

        Raises:
            ParameterError: the number of positions is wrong.
        """

    def move_to_posture(self, name: str, *, speed: float = 1.0) -> Task:
        """Move to a named posture.

        Raises:
            ParameterError: the arm has no such posture.
        """

    def move_tool(
        self, pose: FloatArray, *, straight: bool = False, touching: Iterable[Block | str] = (),
        width: float | None = None, speed: float = 1.0,
    ) -> Task:  # fmt: skip
        """Move the tool to a pose.

        Args:
            pose: of the tool.
            straight: along a line, with an even turn.
            touching: blocks, or names of boxes, that the fingers and what they hold may touch.
            width: between the fingers, metres, for which the motion has room; None: as they are.
            speed: share of the top speed.
        """

    def plan_grasps(self, block: Block) -> GraspTask:
        """Look for grasps of a block; fails with NO_MOTION_PLAN if there is none."""

    def plan_place(self, tools: Sequence[FloatArray], *, above: float, width: float) -> PlaceTask:
        """Look for a place where the block in the hand can be put down, and for the way above it.

        It fails with NO_MOTION_PLAN if there is none.

        Args:
            tools: poses (4, 4) where the fingers may open, the best first.
            above: metres over it from which the block is lowered in a straight line.
            width: between the open fingers, metres.
        """

    def follow(self, trajectory: JointTrajectory, *, fixed: bool = True) -> Task:
        """Move along a trajectory that begins where the arm is and ends at rest.

        Args:
            trajectory: the way.
            fixed: whether this way is meant; else another one to its end is planned if something
                stays in it.

        Raises:
            ParameterError: it begins elsewhere, goes beyond the limits of a joint or its speed,
                does not end at rest, has numbers that are not finite, or the joints are not
                measured yet.
        """


class Gripper(Protocol):
    """The gripper of the robot."""

    @property
    def state(self) -> GripperState | None:
        """The newest measurement; None before the first one."""

    @property
    def width_max(self) -> float:
        """Distance between the open fingers, metres."""

    def move(self, width: float, force: float | None = None) -> Task:
        """Move the fingers until they reach a width or hold something; both are a success.

        Args:
            width: distance between the fingers, metres.
            force: with which they press at most, N; None: the largest.

        Raises:
            ParameterError: the gripper cannot open so wide, or press so hard.
        """
