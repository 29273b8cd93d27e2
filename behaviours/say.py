"""Tell the operator something."""

from __future__ import annotations

from py_trees.common import Status

from behaviours.base import RobotBehaviour, port


class Say(RobotBehaviour):
    """Put a line into the event log, where the operator and the report see it."""

    can_fail = False

    text: str = port("what to say")

    def update(self) -> Status:
        """Say it once."""
        self.robot.say(self.text)
        self.feedback_message = self.text
        return Status.SUCCESS
