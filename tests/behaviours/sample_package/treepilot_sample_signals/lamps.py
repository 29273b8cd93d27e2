"""A class named by an entry point of its own."""

from __future__ import annotations

from py_trees.common import Status

from behaviours.base import RobotBehaviour


class Flash(RobotBehaviour):
    """Flash the lamp."""

    def update(self) -> Status:
        """Flash once."""
        self.robot.say("flash")
        return Status.SUCCESS
