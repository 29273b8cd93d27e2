"""What a person does on touching a robot: push it a little, stop, and go on later."""

from __future__ import annotations

STOPPING_TIME = 0.2
"""Seconds in which a person who touches a robot comes to a stand: at 1 m/s a push by 10 cm."""

STANDING_TIME = 2.0
"""Seconds for which the person then stands."""


class Bump:
    """Slows a person down who touches a robot.

    The bodies of people are moved and have no mass in the physics: without this a person would
    push a robot along for as long as they touch.
    """

    def __init__(self) -> None:
        self._since: float | None = None

    @property
    def is_under_way(self) -> bool:
        """Whether a touch still slows the person down."""
        return self._since is not None

    def share(self, period: float, touches: bool) -> float:
        """Return the share of the wanted speed, 0 to 1, for the next `period` seconds.

        Args:
            period: seconds.
            touches: whether a robot touches the person now.
        """
        if self._since is None:
            if not touches:
                return 1.0
            self._since = 0.0
        self._since += period
        if self._since >= STOPPING_TIME + STANDING_TIME:
            self._since = None
            return 1.0
        return max(0.0, 1.0 - self._since / STOPPING_TIME)
