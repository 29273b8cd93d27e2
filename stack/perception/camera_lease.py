"""Camera lease: cameras take pictures only while somebody asks for them."""

from __future__ import annotations

LEASE = 1.0
"""Seconds for which a request keeps the camera on."""


class CameraLease:
    """Time until which pictures are requested.

    Args:
        always: whether the camera stays on without requests.
    """

    def __init__(self, *, always: bool = False) -> None:
        self._always = always
        self._until = -1.0
        self._since = 0.0

    def renew(self, now: float) -> None:
        """Keep the camera on for another second."""
        if not self.is_active(now):
            self._since = now
        self._until = now + LEASE

    def is_active(self, now: float) -> bool:
        """Return whether pictures are requested now."""
        return self._always or now < self._until

    def covers(self, stamp: float) -> bool:
        """Return whether a picture was taken since the camera was last switched on.

        Older ones are out of date.
        """
        return stamp >= self._since
