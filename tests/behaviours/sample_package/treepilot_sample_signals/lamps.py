"""A class named by an entry point of its own."""

from __future__ import annotations

from treepilot import Behaviour, Status


class Flash(Behaviour):
    """Flash the lamp."""

    def update(self) -> Status:
        """Flash once."""
        self.robot.say("flash")
        return Status.SUCCESS
