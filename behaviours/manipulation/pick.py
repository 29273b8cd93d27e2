"""Picking a block up."""

from __future__ import annotations

from collections.abc import Generator

import numpy as np
from py_trees.common import Status

from behaviours._arm.acting import MOTION_FAILURES, ArmBehaviour
from behaviours._arm.blocks import KnownBlock, is_on, nearest_first, where
from behaviours._motion.driving import Steps
from behaviours.base import output, port
from stack.types import OBJECT_COLOURS, Block, FailureCode, GraspPlan

CANDIDATES = 3
"""Grasps that are tried."""

LOOK = 0.6
"""Seconds for a picture of the camera in the hand: it takes five or more per second."""

NEIGHBOURS = 0.04
"""Metres between the circles around two blocks: the look from near does not tell colours."""

ELSEWHERE = 0.006
"""Metres: nearer to its place the fingers grasp a block without another plan."""


class Pick(ArmBehaviour):
    """Grasp a block and lift it.

    It takes the nearest block of the colour that `detect_blocks` has found, or one at a known
    place. The fingers open, the arm moves in front of the block, approaches in a straight line,
    grasps and lifts it. Before the approach a depth camera in the hand looks closer, and the grasp
    is planned again if the block is elsewhere. A grasp without a free way is replaced by the next
    one, and a block without a grasp by the next block. Fails with OBJECT_NOT_FOUND if no such block
    was detected, NO_MOTION_PLAN if no block can be grasped, MISSED if the fingers close on nothing,
    and SLIPPED if the block is lost in the lift: detect the blocks again.
    """

    colour: str | None = port("of the block; default: any", default=None, one_of=OBJECT_COLOURS)
    at: KnownBlock | None = port("instead: a block at a known place", default=None)
    spare: list[str] = port("boxes of the world whose blocks are left alone", default=[])
    force: float | None = port(
        "with which the fingers press; default: the largest", unit="N", default=None, above=0.0
    )
    picked: str = output("colour of the block")
    width: float = output("of the block between the fingers", unit="m")

    claims = ("arm", "gripper")
    box_ports, block_port = ("spare",), "at"
    fails_with = (
        *MOTION_FAILURES, FailureCode.OBJECT_NOT_FOUND, FailureCode.MISSED,
    )  # fmt: skip

    def initialise(self) -> None:
        self._steps = self._pick()

    def update(self) -> Status:
        return self.advance(self._steps)

    def _pick(self) -> Steps:
        blocks = self._blocks()
        if not blocks:
            wanted = f"{self.colour} block" if self.colour else "block"
            self.fail(FailureCode.OBJECT_NOT_FOUND, f"no {wanted} was detected")
            return False
        for block in blocks:
            if (yield from self._pick_block(block)):
                self.picked = block.colour
                return True
            if not self.is_unplanned or self.robot.arm.held is not None:
                return False
        return False

    def _pick_block(self, block: Block, *, is_near: bool = False) -> Steps:
        """Pick a block; `is_near`: its place is from a closer look."""
        search = self.robot.arm.plan_grasps(block)
        if not (yield from self.done(search, f"looking for a grasp of the {block.colour} block")):
            return False
        self.robot.arm.tell(
            "picks", f"picks the {block.colour} block at {where(block.pose)}", colour=block.colour
        )
        for grasp in search.grasps[:CANDIDATES]:
            if (yield from self._go_before(grasp)):
                looks = not is_near and self.at is None
                elsewhere = (yield from self._look_closer(block)) if looks else None
                if elsewhere is not None:
                    self.robot.arm.see((elsewhere,), gone=(block,))
                    return (yield from self._pick_block(elsewhere, is_near=True))
                if (yield from self._grasp(block, grasp)):
                    return (yield from self._lift(block, grasp))
            if not self.is_unplanned:
                return False
        return False

    def _go_before(self, grasp: GraspPlan) -> Steps:
        arm = self.robot.arm
        return (yield from self.open(grasp.opening)) and (
            yield from self.done(arm.move_joints(grasp.pre_grasp), grasp.name)
        )

    def _look_closer(self, block: Block) -> Generator[None, None, Block | None]:
        """Return the block if the camera in the hand sees it beside its place; else None.

        It does not look if another block is so near that it may be taken for this one.
        """
        perception, known = self.robot.perception, self.robot.arm.blocks.values()
        if not perception.hand_camera or any(_are_near(block, other) for other in known):
            return None
        timer, began = self.start_timer(), self.robot.time
        while (seen := perception.look_closer(block, began)) is None:
            if timer.is_over(LOOK):
                return None
            self.feedback_message = "looking closer"
            yield
        off = float(np.linalg.norm(seen.pose[:3, 3] - block.pose[:3, 3]))
        return seen if off > ELSEWHERE else None

    def _grasp(self, block: Block, grasp: GraspPlan) -> Steps:
        return (yield from self.line(grasp.tool, "approaching", (block,))) and (
            yield from self._close(block)
        )

    def _close(self, block: Block) -> Steps:
        """Close the fingers on a block; one that they miss is not known any more."""
        if (yield from self.close(self.force)):
            return True
        if self.failure is not None and self.failure.code == FailureCode.MISSED:
            self.robot.arm.see((), gone=(block,))
        return False

    def _lift(self, block: Block, grasp: GraspPlan) -> Steps:
        state = self.robot.gripper.state
        assert state is not None, "the fingers hold something"
        self.width = state.width
        self.robot.arm.hold(block, state.width)
        if not (yield from self.line(grasp.lift, "lifting")):
            return False
        if not self.holds_something:
            self.robot.arm.release(lost=True)
            sentence = f"the {block.colour} block slipped in the lift"
            self.robot.arm.tell("lost", sentence, colour=block.colour)
            self.fail(FailureCode.SLIPPED, sentence)
            return False
        self.feedback_message = f"holds the {block.colour} block"
        width = f"{1e3 * state.width:.0f} mm between the fingers"
        self.robot.arm.tell(
            "picked", f"{self.feedback_message}, {width}", colour=block.colour, width=state.width
        )
        return True

    def _blocks(self) -> list[Block]:
        if self.at is not None:
            return [self.at.block(self.robot.time)]
        arm = self.robot.arm
        spared = [arm.box(name) for name in self.spare]
        return nearest_first(
            block
            for block in arm.blocks.values()
            if self.colour in (None, block.colour) and not any(is_on(block, it) for it in spared)
        )


def _are_near(one: Block, other: Block) -> bool:
    """Whether two blocks are near enough to be taken for each other from above."""
    apart = (one.pose - other.pose)[:3, 3]
    radii = float(np.hypot(*one.size[:2]) + np.hypot(*other.size[:2])) / 2.0
    is_same = np.linalg.norm(apart) < ELSEWHERE
    return not is_same and bool(np.hypot(*apart[:2]) < radii + NEIGHBOURS)
