"""Behaviours that command velocities, and those whose course of action is a generator."""

from __future__ import annotations

from collections.abc import Generator

from py_trees.common import Status

from behaviours.base import RobotBehaviour
from stack.types import STANDSTILL

TIME_TO_LIVE = 0.3
"""Seconds that a command is valid: three ticks, so that a late tick does not stop the robot."""

Steps = Generator[None, None, bool]
"""A course of action: goes on to the next `yield` in each tick, returns whether it succeeded."""


class DrivingBehaviour(RobotBehaviour):
    """Base class of behaviours that command velocities in their ticks."""

    def terminate(self, new_status: Status) -> None:
        """Stop the robot if this node was running; another node may drive it otherwise."""
        super().terminate(new_status)
        if self.status is Status.RUNNING:
            self.robot.base.drive_for(STANDSTILL, TIME_TO_LIVE)

    def advance(self, steps: Steps) -> Status:
        """Go on until the next `yield`; steps that end with False have set `failure`."""
        try:
            next(steps)
        except StopIteration as ended:
            if ended.value:
                return Status.SUCCESS
            assert self.failure is not None, "failed steps have set a reason"
            return self.fail(self.failure.code, self.failure.sentence)
        return Status.RUNNING
