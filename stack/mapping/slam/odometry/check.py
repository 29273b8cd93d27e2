"""Odometry compared with matched scans: where it contradicts them, it is believed less, and noted.

The difference of both motions is tested against the covariance of both. What lies beyond it is a
slip, a push, or odometry that was reset: the edge of the graph gets the error that was seen.
"""

from __future__ import annotations

from collections import deque
from math import degrees, hypot

import numpy as np

from stack.mapping.slam.odometry.error import odometry_covariance
from stack.types import FloatArray, Pose2D, wrap_angle

CONTRADICTION = 25.0
"""Squared difference of the motions, in standard deviations, from which they contradict."""

NOTED_DISTANCE, NOTED_TURN = 0.5, 0.3
"""Metres and radians of a contradiction that is noted; smaller ones are slips of wheels."""

GAP, GAP_PERIODS = 1.0, 5.0
"""Seconds, and usual times between two scans, without a scan that are noted."""

COMPARED, LEFT_SHARE, LEAST_TURN = 60, 0.3, 0.5
"""Scans of which the turns are compared; share of their squared differences that is left if
odometry is late or turned round; and the least sum of turns, radians."""

MOST_NOTES = 20


class OdometryCheck:
    """Compares each motion by odometry with the match of its scan."""

    def __init__(self) -> None:
        self._notes: list[str] = []
        self._told = 0
        self._stamp: float | None = None
        self._periods: deque[float] = deque(maxlen=COMPARED)
        self._turns: deque[tuple[float, float]] = deque(maxlen=COMPARED)
        self._has_judged = False

    def take_notes(self) -> list[str]:
        """Return what was found since the last call, as sentences."""
        notes, self._notes = self._notes, []
        return notes

    def elapsed(self, stamp: float) -> float:
        """Take the stamp of a new scan; return the seconds since the last one, at least 0."""
        before, self._stamp = self._stamp, stamp
        if before is None:
            return 0.0
        passed = max(0.0, stamp - before)
        usual = float(np.median(self._periods)) if self._periods else passed
        self._periods.append(passed)
        if passed > max(GAP, GAP_PERIODS * usual):
            self._note(
                f"no scan for {passed:.1f} s before {stamp:.1f} s; odometry carries the pose"
            )
        return passed

    def compare(
        self, stamp: float, moved: Pose2D, matched: Pose2D, covariance: FloatArray
    ) -> FloatArray:
        """Return the squared errors (3,) by which odometry is wrong beyond its covariance.

        Args:
            stamp: of the scan.
            moved: motion since the scan before, by odometry.
            matched: the same motion by matched scans.
            covariance: (3, 3) of `matched`.
        """
        off = matched.relative_to(moved)
        error = np.array([off.x, off.y, wrap_angle(off.heading)])
        covariance = odometry_covariance(moved) + covariance
        if hypot(off.x, off.y) <= NOTED_DISTANCE:
            self._compare_turns(moved.heading, matched.heading)
        if error @ np.linalg.solve(covariance, error) < CONTRADICTION:
            return np.zeros(3)
        if hypot(off.x, off.y) > NOTED_DISTANCE or abs(error[2]) > NOTED_TURN:
            self._note(
                f"at {stamp:.1f} s odometry reports a motion of {hypot(moved.x, moved.y):.2f} m and"
                f" {degrees(moved.heading):.0f} deg, the scans show"
                f" {hypot(matched.x, matched.y):.2f} m and {degrees(matched.heading):.0f} deg"
            )
        place = off.x**2 + off.y**2
        return np.array([place, place, error[2] ** 2])

    def _compare_turns(self, moved: float, matched: float) -> None:
        """Note once that the turns of odometry come later than those of the scans, or reversed."""
        self._turns.append((moved, matched))
        if self._has_judged or len(self._turns) < COMPARED:
            return
        by_odometry, by_scans = np.array(self._turns).T
        wrong = np.square(by_odometry - by_scans).sum()
        if np.abs(by_scans).sum() < LEAST_TURN or wrong < COMPARED * 0.01**2:
            return
        late = np.square(by_odometry[1:] - by_scans[:-1]).sum()
        reversed_ = np.square(by_odometry + by_scans).sum()
        if min(late, reversed_) > LEFT_SHARE * wrong:
            return
        self._has_judged = True
        self._note(
            "odometry is one scan late: the scans show each turn earlier" if late < reversed_ else
            "the scans turn against odometry: the beams of the lidar run the other way round, or"
            " the heading of odometry does"
        )  # fmt: skip

    def note_loss(self, stamp: float) -> None:
        """Note that neither odometry nor scans tell the pose: a new local map begins."""
        self._note(
            f"at {stamp:.1f} s the scans fit neither odometry nor the map around: a new part of the"
            " map begins; it is joined where the robot comes back to known places"
        )

    def _note(self, text: str) -> None:
        """Keep a sentence for `take_notes`; at most MOST_NOTES in all."""
        self._told += 1
        if self._told <= MOST_NOTES:
            self._notes.append(text)
