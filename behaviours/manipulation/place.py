"""Placing the block in the hand."""

from __future__ import annotations

from collections.abc import Iterator
from math import pi

import numpy as np
from py_trees.common import Status

from behaviours._arm.acting import MOTION_FAILURES, ArmBehaviour
from behaviours._arm.blocks import ABOVE, DROP, free_places, on_top, standing
from behaviours._arm.poses import ToolPose
from behaviours._motion.driving import Steps
from behaviours.base import port
from stack.errors import ParameterError
from stack.types import OBJECT_COLOURS, Block, FailureCode, FloatArray

TURNS = (0.0, pi / 2.0, pi, -pi / 2.0)
"""Radians about the vertical; a block looks the same."""

OPENED = 0.016
"""Metres by which the fingers open: they leave what stands beside the block alone."""

PLACES = 6
"""Free places that are tried."""


class Place(ArmBehaviour):
    """Put the block in the hand down: on a box of the world, on another block, or at a pose.

    On a box, it takes the free place nearest to the middle that the arm reaches. The arm moves
    above the place, lowers the block in a straight line, opens the fingers and moves up. Fails with
    MISSED if the hand holds no block, SLIPPED if the block was lost on the way, GOAL_OCCUPIED if no
    place is free, and UNREACHABLE or NO_MOTION_PLAN if the arm comes to none.
    """

    on: str | None = port("name of a box of the world", default=None)
    block: str | None = port(
        "instead: colour of the block to put it on", default=None, one_of=OBJECT_COLOURS
    )
    pose: ToolPose | None = port(
        "instead: where the tool opens, in the arm's base link", default=None
    )

    claims = ("arm", "gripper")
    one_port_of = ("on", "block", "pose")
    box_ports = ("on",)
    fails_with = (
        *MOTION_FAILURES, FailureCode.OBJECT_NOT_FOUND, FailureCode.MISSED, FailureCode.SLIPPED,
    )  # fmt: skip

    def initialise(self) -> None:
        if sum(goal is not None for goal in (self.on, self.block, self.pose)) != 1:
            raise ParameterError("", "place needs exactly one of on, block and pose")
        self._steps = self._place()

    def update(self) -> Status:
        return self.advance(self._steps)

    def _place(self) -> Steps:
        held = self.robot.arm.held
        if held is None:
            self.fail(FailureCode.MISSED, "the hand holds no block")
            return False
        if self.block is None:
            self.fail(FailureCode.GOAL_OCCUPIED, f"no place on {self.on} is free")
        else:
            self.fail(FailureCode.OBJECT_NOT_FOUND, f"no {self.block} block was detected")
        for tool in self._tools(held):
            if (yield from self.done(self.robot.arm.move_tool(_above(tool)), "moving above")):
                return (yield from self._put_down(held, tool))
            if not self.is_unplanned:
                break
        return False

    def _put_down(self, held: Block, tool: FloatArray) -> Steps:
        arm = self.robot.arm
        state = self.robot.gripper.state
        if state is None or not self.holds_something:
            arm.release(lost=True)
            self.fail(FailureCode.SLIPPED, f"the {held.colour} block was lost on the way")
            return False
        if not (yield from self.line(tool, "lowering")):
            return False
        width = min(state.width + OPENED, self.robot.gripper.width_max)
        if not (yield from self.open(width)):
            return False
        arm.release()
        left = tuple(arm.blocks.values())  # the fingers may still touch what they have left
        return (yield from self.line(_above(tool), "moving up", left))

    def _tools(self, held: Block) -> Iterator[FloatArray]:
        """Yield poses (4, 4) of the tool that leave the block at the place, the best first."""
        arm = self.robot.arm
        if self.pose is not None:
            yield self.pose.matrix()
            return
        tool = arm.tool_pose
        assert tool is not None, "the arm has just told where the block is"
        grip = np.linalg.inv(held.pose) @ tool
        for x, y, z, yaw in self._places(held):
            for turn in TURNS:
                yield standing(x, y, z + held.size[2] / 2.0 + DROP, yaw + turn) @ grip

    def _places(self, held: Block) -> list[tuple[float, float, float, float]]:
        """Return places for the underside of the block: x, y, z and yaw in the base link."""
        arm = self.robot.arm
        if self.on is not None:
            return free_places(arm.box(self.on), held, arm.blocks.values())[:PLACES]
        return [on_top(block) for block in arm.blocks.values() if block.colour == self.block]


def _above(tool: FloatArray) -> FloatArray:
    moved = tool.copy()
    moved[2, 3] += ABOVE
    return moved
