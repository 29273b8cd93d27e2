"""How far the estimate is trusted: recent views, and confirmation of poses that a search found."""

from __future__ import annotations

from stack.localisation.health import FitScale, RecentViews, ScanView
from stack.localisation.health_model import HealthFeatures
from stack.localisation.particle_filter.hypotheses import Hypotheses

OBSCURED_SHORT = 0.2
"""Share of beams that end at unmapped things from which on they excuse a low health."""
OBSCURED_LONG = 0.05
"""Share of beams through mapped walls above which they do not excuse it."""

_CONVINCING = 0.5
"""Fit that confirms a pose, between that of most true poses (0) and of the usual ones (1)."""

_CONFIRMED = 1.0
"""Metres driven with fitting scans after which a pose that a search found is trusted."""

MANY_LONG = 0.08
"""Share of long beams that unmapped things do not explain."""


class Confidence:
    """Recent views of the estimate, and whether it is confirmed.

    A pose that was set is confirmed. One that a search found is confirmed once scans have fitted it
    convincingly over a metre, without rivals.

    Attributes:
        views: of the last scans; cleared when the pose jumps.
    """

    def __init__(self) -> None:
        self.views = RecentViews()
        self._driven = 0.0

    @property
    def is_confirmed(self) -> bool:
        """Whether the pose is trusted."""
        return self._driven >= _CONFIRMED

    def restart(self, *, confirmed: bool) -> None:
        """Begin with another pose; scans before say nothing of it."""
        self.views.clear()
        self._driven = _CONFIRMED if confirmed else 0.0

    def add(
        self, stamp: float, view: ScanView, scale: FitScale, travelled: float, *, alone: bool
    ) -> None:
        """Add the view of a scan.

        Args:
            stamp: of the scan, seconds.
            view: comparison of the scan with the map at the estimate.
            scale: fits at true poses of the map.
            travelled: metres since the last scan, turns included.
            alone: whether the estimate has no rivals.
        """
        self.views.add(stamp, view)
        if not self.is_confirmed and alone and scale.relative(view.fit) >= _CONVINCING:
            self._driven += travelled

    def trusts(self, view: ScanView, scale: FitScale, *, alone: bool) -> bool:
        """Return whether a scan leaves no doubt of a confirmed pose without rivals."""
        fits = scale.relative(view.fit) >= _CONVINCING and view.long < MANY_LONG
        return self.is_confirmed and alone and fits

    def needs_verification(self, view: ScanView, scale: FitScale, *, alone: bool) -> bool:
        """Return whether the whole map is to be searched for a better place.

        A trusted pose may be wrong as well: in a building of equal rooms most beams fit in each of
        them, but those that pass through mapped walls go on.
        """
        if self.is_confirmed:
            median = self.views.median
            return alone and median is not None and median.long >= MANY_LONG
        return not (alone and scale.relative(view.fit) >= _CONVINCING)

    def features(self, hypotheses: Hypotheses, scale: FitScale | None) -> HealthFeatures | None:
        """Return what the health follows from; None before the first scan of a pose."""
        now, median = self.views.newest, self.views.median
        if now is None or median is None or scale is None:
            return None
        return HealthFeatures(
            now, median, scale, hypotheses.best.position_deviation,
            min(1.0, self._driven / _CONFIRMED), hypotheses.share_among_rivals,
        )  # fmt: skip

    @property
    def is_obscured(self) -> bool:
        """Whether unmapped things hide the map, and nothing else speaks against the pose."""
        median = self.views.median
        if median is None or not self.is_confirmed:
            return False
        return median.short >= OBSCURED_SHORT and median.long <= OBSCURED_LONG
