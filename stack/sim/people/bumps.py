"""What a person does on touching a robot: push it a little, stop, and go on later."""

from __future__ import annotations

STOPPING_TIME = 0.2
"""Seconds in which a person who touches a robot comes to a stand: at 1 m/s a push by 10 cm."""

STANDING_TIME = 2.0
"""Seconds for which the person then stands."""

PRESSED = 0.02
"""Depth in metres by which the bodies of person and robot overlap if the robot cannot give way: it
stands before a wall. One that can overlaps by at most 1.9 cm, at 1.3 m/s.
"""

RECOIL, RECOIL_TIME = -1.0, 0.5
"""Share of the wanted speed of a person who presses a robot against something, and the seconds for
which they step back: the robot gets room to leave.
"""


class Bump:
    """Slows a person down who touches a robot.

    The bodies of people are moved and have no mass in the physics: without this a person would
    push a robot along for as long as they touch, and press it into a wall, out of which the physics
    would throw it at several metres per second.
    """

    def __init__(self) -> None:
        self._since: float | None = None
        self._recoil = 0.0

    @property
    def is_under_way(self) -> bool:
        """Whether a touch still slows the person down."""
        return self._since is not None

    def share(self, period: float, touch: float | None) -> float:
        """Return the share of the wanted speed, 0 to 1 or `RECOIL`, for the next seconds.

        Args:
            period: seconds.
            touch: depth by which a robot and the person overlap now, metres; None: no touch.
        """
        if touch is not None and touch > PRESSED:
            self._since, self._recoil = STOPPING_TIME, RECOIL_TIME
        if self._recoil > 0.0:
            self._recoil -= period
            return RECOIL
        if self._since is None:
            if touch is None:
                return 1.0
            self._since = 0.0
        self._since += period
        if self._since >= STOPPING_TIME + STANDING_TIME:
            self._since = None
            return 1.0
        return max(0.0, 1.0 - self._since / STOPPING_TIME)
