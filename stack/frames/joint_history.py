"""Positions of joints by time: the newest states of an arm, between which it interpolates."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Mapping, Sequence

from stack.errors import FrameError
from stack.types import FloatArray, JointState

ROUNDING = 1e-9
"""Seconds by which two stamps that are meant to be the same may differ."""


class JointHistory:
    """The states of some joints in the last seconds.

    Args:
        names: of the joints, in the order of their states.
        length: seconds for which states are kept.
    """

    def __init__(self, names: Sequence[str], length: float = 10.0) -> None:
        self.names, self._length = tuple(names), length
        self._stamps: list[float] = []
        self._positions: list[FloatArray] = []
        self._last: tuple[float, Mapping[str, float]] | None = None

    def add(self, state: JointState) -> None:
        """Take a state; one that is not newer than the last one is left out."""
        if self._stamps and state.stamp <= self._stamps[-1]:
            return
        self._stamps.append(state.stamp)
        self._positions.append(state.positions)
        self._last = None
        old = bisect_left(self._stamps, state.stamp - self._length)
        del self._stamps[:old], self._positions[:old]

    def at(self, stamp: float) -> Mapping[str, float]:
        """Return the positions by joint at a stamp, seconds.

        Raises:
            FrameError: no state is known, or the stamp is outside of those that are kept.
        """
        if self._last is not None and self._last[0] == stamp:
            return self._last[1]
        found = dict(zip(self.names, self._interpolated(stamp).tolist(), strict=True))
        self._last = stamp, found
        return found

    def _interpolated(self, stamp: float) -> FloatArray:
        stamps = self._stamps
        if not stamps:
            raise FrameError(f"no state of the joints is known yet; asked for {stamp:.3f} s")
        oldest, newest = stamps[0], stamps[-1]
        if stamp > newest + ROUNDING:
            raise FrameError(
                f"{stamp:.3f} s is {stamp - newest:.3f} s after the newest state of the joints, "
                f"which is of {newest:.3f} s"
            )
        if stamp < oldest - ROUNDING:
            raise FrameError(
                f"{stamp:.3f} s is {oldest - stamp:.3f} s before the oldest state of the joints "
                f"that is kept, which is of {oldest:.3f} s"
            )
        after = min(max(bisect_left(stamps, stamp), 1), len(stamps) - 1)
        if len(stamps) == 1 or abs(stamps[after] - stamp) <= ROUNDING:
            return self._positions[0 if len(stamps) == 1 else after]
        begin, end = stamps[after - 1], stamps[after]
        share = (stamp - begin) / (end - begin)
        moved: FloatArray = self._positions[after - 1] + share * (
            self._positions[after] - self._positions[after - 1]
        )
        return moved
