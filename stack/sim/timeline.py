"""Scheduler of a world's timeline: doors, a lifted robot, changes of the battery charge."""

from __future__ import annotations

from math import hypot

from stack.sim.worlds.world import Trigger, WorldEvent
from stack.types import Pose2D

_ROUNDING = 1e-9


class Timeline:
    """The timeline entries of a world that have not happened yet; each happens once."""

    def __init__(self, world_events: tuple[WorldEvent, ...]) -> None:
        self._waiting = list(world_events)
        self._triggered: list[tuple[float, WorldEvent]] = []

    def due(self, time: float, robot: Pose2D) -> list[WorldEvent]:
        """Return the entries that happen now, in the order in which they were triggered."""
        still: list[WorldEvent] = []
        for event in self._waiting:
            if _triggers(event.trigger, time, robot):
                self._triggered.append((time + event.trigger.after, event))
            else:
                still.append(event)
        self._waiting = still
        now = [entry for entry in self._triggered if entry[0] <= time + _ROUNDING]
        if now:
            self._triggered = [entry for entry in self._triggered if entry not in now]
        return [event for _, event in now]


def _triggers(trigger: Trigger, time: float, robot: Pose2D) -> bool:
    if trigger.time is not None and time < trigger.time - _ROUNDING:
        return False
    if trigger.near is None:
        return True
    x, y, radius = trigger.near
    return hypot(robot.x - x, robot.y - y) <= radius
