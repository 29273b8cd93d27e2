"""Signals for people: a behaviour that treepilot finds once this package is installed."""

from __future__ import annotations

from treepilot import Behaviour, Status, port


class HonkHorn(Behaviour):
    """Tell the people around that a robot is coming."""

    times: int = port("how often", default=1, at_least=1)

    def update(self) -> Status:
        """Honk, for want of a horn in words."""
        self.robot.say(" ".join(["honk"] * self.times))
        return Status.SUCCESS
