"""Camera lease: cameras take pictures only while pictures are requested."""

from __future__ import annotations


class CameraLease:
    """Time until which pictures are requested.

    Args:
        seconds: for which a request keeps the camera on.
        always: whether the camera stays on without requests.
    """

    def __init__(self, seconds: float = 1.0, *, always: bool = False) -> None:
        self._seconds, self._always = seconds, always
        self._until = -1.0
        self._since = 0.0

    def renew(self, now: float) -> None:
        """Keep the camera on from now for the time of a request."""
        if not self.is_active(now):
            self._since = now
        self._until = now + self._seconds

    def is_active(self, now: float) -> bool:
        """Return whether pictures are requested now."""
        return self._always or now < self._until

    def covers(self, stamp: float) -> bool:
        """Return whether a picture was taken since the camera was last switched on.

        Older ones are out of date.
        """
        return stamp >= self._since
