"""Recovery from a wrong pose: search near the estimate, then farther, then on the whole map.

A push moves the robot without its wheels, so the scans stop fitting. The search starts as soon as
they have done so for a moment, also at standstill, and widens while they still do not fit. What it
finds becomes hypotheses of the filter; their evidence decides.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, pi

from stack.localisation.health import ScanView

RECOVERY_TIME = 0.3
"""Time of badly fitting scans after which the pose is searched near the estimate, s."""
RECOVERY_PERIOD = 0.5
"""Time between two searches near the estimate, s."""
RECOVERY_DISTANCE = 1.0
"""Half the side of the first search window; it widens with each search, m."""
RECOVERY_ANGLE = 0.53
"""Largest heading difference of the first search window, rad."""
GLOBAL_PERIOD = 3.0
"""Time between two searches of the whole map while lost, s."""

_WIDER = ((1.0, 1.0), (1.0, 2.0), (2.0, 3.0), (2.5, 6.0))
"""Factors of distance and angle of the successive windows."""

_DROP = 0.12
"""Drop of the fit below the usual one that starts a search near the estimate."""

_RECOVERED = 1.0
"""Seconds of well fitting scans after which the windows are small again."""

_SETTLED = 10.0
"""Seconds of well fitting scans after which the whole map is searched as often as at first."""


@dataclass(frozen=True, slots=True)
class Search:
    """A search to run now.

    Attributes:
        distance: half the side of the window, metres; inf: the whole map.
        angle: largest heading difference, radians.
    """

    distance: float
    angle: float

    @property
    def is_global(self) -> bool:
        """Whether it searches the whole map."""
        return self.distance == inf


class RecoverySchedule:
    """Decides which search to run at a scan. Times are stamps of scans."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Start without doubt."""
        self._doubt: float | None = None
        self._fine: float | None = None
        self._stage = self._searches = 0
        self._next = self._next_global = self._disturbed_until = self._touched_until = -inf
        self._verify = inf
        self._usual: float | None = None

    def disturb(self, stamp: float) -> None:
        """State that odometry was disturbed before a stamp: the windows begin wider."""
        self._disturbed_until = stamp + 2.0
        self._stage = max(self._stage, 1)

    def touch(self, stamp: float) -> None:
        """State that something touched the robot: it is near its last place, if it moved at all.

        The windows begin again, so that the whole map is searched only some time after.
        """
        self._touched_until = stamp + 2.0
        self._stage = min(self._stage, 1)

    def verify(self, stamp: float) -> None:
        """Search the whole map soon, for rivals of a pose that was found near the old one."""
        self._verify = min(self._verify, stamp + RECOVERY_PERIOD)

    def is_disturbed(self, stamp: float) -> bool:
        """Return whether odometry was disturbed shortly before a stamp."""
        return stamp <= self._disturbed_until

    def is_touched(self, stamp: float) -> bool:
        """Return whether something touched the robot shortly before a stamp."""
        return stamp <= self._touched_until

    def next(self, stamp: float, view: ScanView, low: float) -> Search | None:
        """Return the search to run at a scan, or None.

        Args:
            stamp: of the scan, seconds.
            view: comparison of the scan with the map at the estimate.
            low: fit that most scans at a true pose exceed.
        """
        drop = 0.0 if self._usual is None else self._usual - view.fit
        self._usual = view.fit if self._usual is None else self._usual + 0.05 * -drop
        fits = view.fit >= low and drop < _DROP
        if fits:
            return self._well(stamp)
        self._fine = None
        if self._doubt is None:
            self._doubt = stamp
        hurry = self.is_disturbed(stamp)
        waited = stamp - self._doubt >= (0.0 if hurry else RECOVERY_TIME) - 1e-9
        if not waited or stamp < self._next:
            return None
        self._next = stamp + RECOVERY_PERIOD
        if self._stage < len(_WIDER):
            farther, wider = _WIDER[self._stage]
            if self._stage == 0 or view.fit < low:
                self._stage += 1
            return Search(farther * RECOVERY_DISTANCE, min(pi, wider * RECOVERY_ANGLE))
        return self._whole_map(stamp) if view.fit < low else None

    def _well(self, stamp: float) -> Search | None:
        """End the doubt; return a global search that is due to verify a new pose."""
        self._doubt = None
        if self._fine is None:
            self._fine = stamp
        if stamp - self._fine >= _RECOVERED:
            self._stage = 0
        if stamp - self._fine >= _SETTLED and self._verify == inf:
            self._searches = 0
        return self._whole_map(stamp) if stamp >= self._verify else None

    def _whole_map(self, stamp: float) -> Search | None:
        if stamp < self._next_global:
            return None
        # A map that the search has not resolved is searched less and less often.
        self._next_global = stamp + GLOBAL_PERIOD * 2.0 ** min(self._searches, 4)
        self._searches += 1
        self._verify = inf
        return Search(inf, pi)
