"""Base classes of behaviours: with a course of action as a generator, and those that drive."""

from __future__ import annotations

from collections.abc import Generator

from py_trees.common import Status

from behaviours.base import RobotBehaviour
from stack.robot import Task
from stack.types import STANDSTILL

TIME_TO_LIVE = 0.3
"""Seconds that a command is valid: three ticks, so that a late tick does not stop the robot."""

Steps = Generator[None, None, bool]
"""A course of action: goes on to the next `yield` in each tick, returns whether it succeeded."""


class SteppedBehaviour(RobotBehaviour):
    """Base class of behaviours whose course of action is a generator."""

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

    def done(self, task: Task, doing: str = "") -> Steps:
        """Wait for the end of a task; return whether it succeeded.

        Args:
            task: to follow.
            doing: feedback meanwhile; empty: that of the task.
        """
        while (status := self.follow(task)) is Status.RUNNING:
            self.feedback_message = doing or self.feedback_message
            yield
        return status is Status.SUCCESS


class DrivingBehaviour(SteppedBehaviour):
    """Base class of behaviours that command velocities in their ticks."""

    def terminate(self, new_status: Status) -> None:
        """Stop the robot if this node was running; another node may drive it otherwise."""
        super().terminate(new_status)
        if self.status is Status.RUNNING:
            self.robot.base.drive_for(STANDSTILL, TIME_TO_LIVE)

    def stand(self, *, gives_way: bool = False) -> None:
        """Command standstill until the next ticks; `gives_way`: leave the way of people."""
        self.robot.base.drive_for(STANDSTILL, TIME_TO_LIVE, gives_way=gives_way)
