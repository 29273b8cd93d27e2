"""What happens in a world by itself: doors that move, a robot that is lifted, a failing battery."""

from __future__ import annotations

from math import hypot

from stack.sim.world import Happening, Trigger
from stack.types import Pose2D

_ROUNDING = 1e-9


class Timeline:
    """Says which happenings are due; each is due once."""

    def __init__(self, happenings: tuple[Happening, ...]) -> None:
        self._waiting = list(happenings)
        self._triggered: list[tuple[float, Happening]] = []

    def due(self, time: float, robot: Pose2D) -> list[Happening]:
        """What happens now, in the order of the world file."""
        still: list[Happening] = []
        for happening in self._waiting:
            if _triggers(happening.trigger, time, robot):
                self._triggered.append((time + happening.trigger.after, happening))
            else:
                still.append(happening)
        self._waiting = still
        now = [entry for entry in self._triggered if entry[0] <= time + _ROUNDING]
        if now:
            self._triggered = [entry for entry in self._triggered if entry not in now]
        return [happening for _, happening in now]


def _triggers(trigger: Trigger, time: float, robot: Pose2D) -> bool:
    if trigger.time is not None and time < trigger.time - _ROUNDING:
        return False
    if trigger.near is None:
        return True
    x, y, radius = trigger.near
    return hypot(robot.x - x, robot.y - y) <= radius
