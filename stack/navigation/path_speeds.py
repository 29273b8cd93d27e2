"""Speed limits along a path, with braking before lower limits."""

from __future__ import annotations

from math import hypot, inf, sqrt

import numpy as np

from stack.drivetrain.kinematics import scaled
from stack.types import FloatArray, Path, Twist

BRAKING_SHARE = 0.5
"""Share of the robot's deceleration that is used before a lower limit."""


class PathSpeeds:
    """Highest speed at each point of a path.

    Before a lower limit the speed falls in time: v² = w² + 2 a s for a limit w at s metres ahead.

    Args:
        path: with or without limits.
        deceleration: of the robot, m/s².
    """

    def __init__(self, path: Path, deceleration: float) -> None:
        self._along: FloatArray | None = None
        self._limits = self._posted = np.empty(0)
        if path.speed_limits is None:
            return
        steps = np.linalg.norm(np.diff(path.points[:, :2], axis=0), axis=1)
        self._along = np.concatenate([[0.0], np.cumsum(steps)])
        limits = path.speed_limits.copy()
        gain = 2.0 * BRAKING_SHARE * deceleration
        for at in range(len(limits) - 2, -1, -1):
            limits[at] = min(limits[at], sqrt(limits[at + 1] ** 2 + gain * steps[at]))
        self._limits, self._posted = limits, path.speed_limits

    def posted(self, travelled: float) -> float:
        """The limit at this point of the path, without braking, m/s; inf if none."""
        return inf if self._along is None else float(self._posted[self._index(travelled)])

    def at(self, travelled: float) -> float:
        """The highest speed this many metres along the path, m/s; inf if none."""
        return inf if self._along is None else float(self._limits[self._index(travelled)])

    def _index(self, travelled: float) -> int:
        assert self._along is not None
        at = int(np.searchsorted(self._along, travelled, side="right")) - 1
        return min(max(at, 0), len(self._limits) - 1)


def slower(twist: Twist, limit: float) -> Twist:
    """Scale a twist to a speed limit in m/s; the arc stays the same."""
    speed = hypot(twist.linear, twist.lateral)
    if speed <= limit:
        return twist
    return scaled(twist, limit / speed)
