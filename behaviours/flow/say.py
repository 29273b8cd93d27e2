"""Messages to the operator."""

from __future__ import annotations

from py_trees.common import Status

from behaviours.base import RobotBehaviour, port


class Say(RobotBehaviour):
    """Write a message to the event log."""

    also_known_as = ("log", "print", "speak")
    is_instant = runs_in_tests = True
    can_fail = False
    fails_with = ()

    text: str = port("message")

    def update(self) -> Status:
        self.robot.say(self.text)
        self.feedback_message = self.text
        return Status.SUCCESS
