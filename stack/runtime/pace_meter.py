"""How fast the robot's clock runs against the wall's, for displays only."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from time import perf_counter

AVERAGING_TIME = 5.0
"""Wall seconds over which the speed is averaged."""

SAMPLE_PERIOD = 0.1
"""Wall seconds between two samples."""


class PaceMeter:
    """Robot seconds per wall second over AVERAGING_TIME, without the time in which it is held.

    Args:
        clock: returns wall seconds.
    """

    def __init__(self, clock: Callable[[], float] = perf_counter) -> None:
        self._clock = clock
        self._wall, self._time = clock(), 0.0
        self._held = False
        self._driven: tuple[float, float] = (0.0, 0.0)  # wall and robot seconds without holds
        self._samples: deque[tuple[float, float]] = deque([self._driven])

    def advance(self, time: float, held: bool) -> None:
        """Take the present time; call it once per step, also while a simulation is frozen.

        Args:
            time: robot's clock, seconds.
            held: whether the mission is paused or stopped.
        """
        wall = self._clock()
        if not (held or self._held):
            self._driven = (
                self._driven[0] + wall - self._wall, self._driven[1] + time - self._time,
            )  # fmt: skip
        self._wall, self._time, self._held = wall, time, held
        if self._driven[0] - self._samples[-1][0] >= SAMPLE_PERIOD:
            self._samples.append(self._driven)
        while len(self._samples) > 2 and self._driven[0] - self._samples[1][0] >= AVERAGING_TIME:
            self._samples.popleft()

    @property
    def factor(self) -> float:
        """Robot seconds per wall second; 0 before the first step."""
        wall, time = (new - old for new, old in zip(self._driven, self._samples[0], strict=True))
        return time / wall if wall > 0.0 else 0.0
