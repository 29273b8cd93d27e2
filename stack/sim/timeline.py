"""Scheduler of a world's timeline: doors, the battery charge, a lifted or pushed robot."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot

from stack.sim.worlds.world import Trigger, WorldEvent
from stack.types import Pose2D

_ROUNDING = 1e-9


class Timeline:
    """The timeline entries of a world that have not happened yet; each happens once."""

    def __init__(self, world_events: tuple[WorldEvent, ...]) -> None:
        self._waiting = list(world_events)
        self._triggered: list[tuple[float, WorldEvent, int]] = []

    def due(self, time: float, robots: Sequence[Pose2D]) -> list[tuple[WorldEvent, int]]:
        """Return the entries that happen now, in the order in which they were triggered.

        Args:
            time: seconds.
            robots: true pose of each robot, world frame.

        Returns:
            Each entry with the number of the robot that triggered it: the first one at its place;
            of an entry without a place, the first robot.
        """
        still: list[WorldEvent] = []
        for event in self._waiting:
            robot = _triggered_by(event.trigger, time, robots)
            if robot is not None:
                self._triggered.append((time + event.trigger.after, event, robot))
            else:
                still.append(event)
        self._waiting = still
        now = [entry for entry in self._triggered if entry[0] <= time + _ROUNDING]
        if now:
            self._triggered = [entry for entry in self._triggered if entry not in now]
        return [(event, robot) for _, event, robot in now]


def _triggered_by(trigger: Trigger, time: float, robots: Sequence[Pose2D]) -> int | None:
    if trigger.time is not None and time < trigger.time - _ROUNDING:
        return None
    if trigger.near is None:
        return 0
    x, y, radius = trigger.near
    near = (n for n, robot in enumerate(robots) if hypot(robot.x - x, robot.y - y) <= radius)
    return next(near, None)
