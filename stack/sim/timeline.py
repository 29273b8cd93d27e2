"""What happens in a world by itself: doors that move, a robot that is lifted, a failing battery."""

from __future__ import annotations

from math import hypot

from stack.sim.worlds.world import Trigger, WorldEvent
from stack.types import Pose2D

_ROUNDING = 1e-9


class Timeline:
    """Says which happenings are due; each is due once."""

    def __init__(self, world_events: tuple[WorldEvent, ...]) -> None:
        self._waiting = list(world_events)
        self._triggered: list[tuple[float, WorldEvent]] = []

    def due(self, time: float, robot: Pose2D) -> list[WorldEvent]:
        """What happens now, in the order of the world file."""
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
