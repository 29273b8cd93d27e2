"""The speed limits of a path, kept to from where they begin."""

from __future__ import annotations

from math import hypot, inf, sqrt

import numpy as np

from stack.types import FloatArray, Path, Twist

BRAKING_SHARE = 0.5
"""Share of the robot's deceleration that is counted on when a lower limit comes nearer."""


class PathSpeeds:
    """How fast a path may be driven at each place.

    Before a lower limit the speed falls so that it is reached there: v² = w² + 2 a s for a limit w
    in s metres.

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
        """The limit of that very place, m/s; inf where there is none."""
        return inf if self._along is None else float(self._posted[self._index(travelled)])

    def at(self, travelled: float) -> float:
        """The limit this many metres along the path, m/s; inf where there is none."""
        return inf if self._along is None else float(self._limits[self._index(travelled)])

    def _index(self, travelled: float) -> int:
        assert self._along is not None
        at = int(np.searchsorted(self._along, travelled, side="right")) - 1
        return min(max(at, 0), len(self._limits) - 1)


def slower(twist: Twist, limit: float) -> Twist:
    """The same arc, driven no faster than a limit in m/s."""
    speed = hypot(twist.linear, twist.lateral)
    if speed <= limit:
        return twist
    share = limit / speed
    return Twist(twist.linear * share, twist.angular * share, twist.lateral * share)
