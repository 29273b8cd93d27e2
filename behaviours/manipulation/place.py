"""Placing the block in the hand."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import islice

import numpy as np
from py_trees.common import Status

from behaviours._arm.acting import MOTION_FAILURES, ArmBehaviour
from behaviours._arm.blocks import ABOVE, DROP, TURNS, free_places, on_top, standing, where
from behaviours._arm.poses import ToolPose
from behaviours._motion.driving import Steps
from behaviours.base import port
from stack.errors import ParameterError
from stack.types import OBJECT_COLOURS, Block, FailureCode, FloatArray

OPENED = 0.016
"""Metres by which the fingers open: they leave what stands beside the block alone."""

PLACES = 48
"""Free places and turns that are tried."""


class Place(ArmBehaviour):
    """Put the block in the hand down: on a box of the world, on another block, or at a pose.

    On a box, it takes the free place nearest to the middle to which the arm has a free way, and
    where the fingers can open. The arm moves above the place, lowers the block in a straight line,
    opens the fingers and moves up. Fails with MISSED if the hand holds no block, SLIPPED if the
    block was lost on the way, GOAL_OCCUPIED if no place is free, and NO_MOTION_PLAN if the arm
    comes to none.
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
        *MOTION_FAILURES, FailureCode.OBJECT_NOT_FOUND, FailureCode.MISSED,
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
        tools = list(self._tools(held))
        if not tools and self.block is None:
            self.fail(FailureCode.GOAL_OCCUPIED, f"no place on {self.on} is free")
        elif not tools:
            self.fail(FailureCode.OBJECT_NOT_FOUND, f"no {self.block} block was detected")
        else:
            return (yield from self._place_at(held, tools))
        return False

    def _place_at(self, held: Block, tools: list[FloatArray]) -> Steps:
        """Put the block down at the first of some poses (4, 4) of the tool that is free."""
        arm, state = self.robot.arm, self.robot.gripper.state
        if state is None or not self.holds_something:
            return self._lost(held)
        width = min(state.width + OPENED, self.robot.gripper.width_max)
        search = arm.plan_place(tools, above=ABOVE, width=width)
        if not (yield from self.done(search, f"looking for a place for the {held.colour} block")):
            return False
        assert search.place is not None, "the search has succeeded"
        if not (yield from self.done(arm.follow(search.place.way, fixed=False), "moving above")):
            return False
        if not self.holds_something:
            return self._lost(held)
        tool = search.place.tool
        if not (yield from self.line(tool, "lowering", width=width)):
            return False
        if not (yield from self.open(width)):
            return False
        self._tell(held, tool)
        arm.release()
        left = tuple(arm.blocks.values())  # the fingers may still touch what they have left
        return (yield from self.line(_above(tool), "moving up", left))

    def _tell(self, held: Block, tool: FloatArray) -> None:
        """Tell where the block is, and how far the tool (4, 4) is from where it should open."""
        arm = self.robot.arm
        block, measured = arm.held, arm.tool_pose
        if block is None or measured is None:
            return
        off = float(np.linalg.norm((measured - tool)[:3, 3]))
        goal = self.on or (f"the {self.block} block" if self.block else "")
        text = f"placed the {held.colour} block {f'on {goal} ' if goal else ''}at "
        text += f"{where(block.pose)} ({1e3 * off:.1f} mm off)"
        arm.tell("placed", text, colour=held.colour, off=round(off, 5))

    def _lost(self, held: Block) -> bool:
        sentence = f"the {held.colour} block was lost on the way"
        self.robot.arm.release(lost=True)
        self.robot.arm.tell("lost", sentence, colour=held.colour)
        self.fail(FailureCode.SLIPPED, sentence)
        return False

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
            yield standing(x, y, z + held.size[2] / 2.0 + DROP, yaw) @ grip

    def _places(self, held: Block) -> Iterable[tuple[float, float, float, float]]:
        """Return places for the underside of the block: x, y, z and yaw in the base link."""
        arm = self.robot.arm
        if self.on is not None:
            return islice(free_places(arm.box(self.on), held, arm.blocks.values()), PLACES)
        below = (on_top(block) for block in arm.blocks.values() if block.colour == self.block)
        return ((x, y, z, yaw + turn) for x, y, z, yaw in below for turn in TURNS)


def _above(tool: FloatArray) -> FloatArray:
    moved = tool.copy()
    moved[2, 3] += ABOVE
    return moved
