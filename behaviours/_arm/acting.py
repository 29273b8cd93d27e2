"""Base class of behaviours that move an arm, and the codes of its failures."""

from __future__ import annotations

from py_trees.common import Status

from behaviours._motion.driving import SteppedBehaviour, Steps
from stack.robot import Task
from stack.types import Block, FailureCode, FloatArray

MOTION_FAILURES = (
    FailureCode.UNREACHABLE, FailureCode.NO_MOTION_PLAN, FailureCode.START_OCCUPIED,
    FailureCode.GOAL_OCCUPIED, FailureCode.COLLISION_AHEAD, FailureCode.ARM_COLLISION,
    FailureCode.NO_PROGRESS, FailureCode.SLIPPED,
)  # fmt: skip
"""Codes of motions of an arm, for `fails_with`."""

UNPLANNED = frozenset({
    FailureCode.UNREACHABLE, FailureCode.NO_MOTION_PLAN, FailureCode.GOAL_OCCUPIED,
    FailureCode.COLLISION_AHEAD,
})  # fmt: skip
"""Codes of motions that have not begun: another goal may be reached."""

SLOW = 0.3
"""Share of the top speed on straight ways to and from a block."""

HOLDS = 0.002
"""Metres between fingers that hold something at least."""


class ArmBehaviour(SteppedBehaviour):
    """Base class of behaviours that move an arm and its gripper."""

    def open(self, width: float | None = None) -> Steps:
        """Open the fingers, as wide as they go by default."""
        gripper = self.robot.gripper
        return self.done(gripper.move(gripper.width_max if width is None else width))

    def close(self, force: float | None) -> Steps:
        """Close the fingers; fails with MISSED if they hold nothing."""
        if not (yield from self.done(self.robot.gripper.move(0.0, force))):
            return False
        if not self.holds_something:
            self.fail(FailureCode.MISSED, "the fingers closed on nothing")
            return False
        return True

    def line(
        self, pose: FloatArray, doing: str, touching: tuple[Block | str, ...] = (),
        width: float | None = None,
    ) -> Steps:  # fmt: skip
        """Move the tool slowly along a line to a pose (4, 4), with room for fingers of a width."""
        motion = self.robot.arm.move_tool(
            pose, straight=True, touching=touching, width=width, speed=SLOW
        )
        return self.done(motion, doing)

    def done(self, task: Task, doing: str = "") -> Steps:
        """As of every stepped behaviour; the feedback also tells what the task reports."""
        while (status := self.follow(task)) is Status.RUNNING:
            if doing:
                self.feedback_message = f"{doing}: {self.feedback_message}"
            yield
        return status is Status.SUCCESS

    @property
    def holds_something(self) -> bool:
        """Whether something keeps the fingers apart."""
        state = self.robot.gripper.state
        return state is not None and state.force > 0.0 and state.width > HOLDS

    @property
    def is_unplanned(self) -> bool:
        """Whether the last motion failed before it began."""
        return self.failure is not None and self.failure.code in UNPLANNED
