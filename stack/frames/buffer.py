"""Transform buffer: where the base was in the odom and map frames at any recent stamp.

A measurement is evaluated with the pose at its own stamp, never with the pose of the step in which
it arrived. Frames follow REP 105: odom -> base is continuous and drifts, map -> odom corrects the
drift and may jump. The idea and the behaviour at the ends of the buffer are those of tf2 (T. Foote,
"tf: The transform library", IEEE TePRA 2013): it interpolates and never extrapolates.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections import deque
from itertools import islice
from typing import Generic, Literal, TypeVar

import numpy as np

from stack.errors import FrameError
from stack.frames.tree import FrameTree, lifted
from stack.types import (
    NO_COVARIANCE,
    FloatArray,
    Odometry,
    Pose2D,
    PoseEstimate,
    has_jumped,
    unwrapped,
    wrap_angle,
)

Frame = Literal["odom", "map"]

TOLERANCE = 1e-9
"""Seconds by which a stamp may exceed the buffer, for rounding."""

SPAN = 10.0
"""Seconds that the buffer covers, unless specified otherwise."""

T = TypeVar("T")


class _Series(Generic[T]):
    """Values by stamp, in order; values older than `span` seconds are dropped."""

    def __init__(self, span: float) -> None:
        self._span = span
        self.stamps: deque[float] = deque()
        self.values: deque[T] = deque()

    def add(self, stamp: float, value: T) -> None:
        """Append a value; one with the stamp of the last value replaces it."""
        if self.stamps and stamp < self.stamps[-1]:
            raise FrameError(
                f"a transform at {stamp:.3f} s came after the one at {self.stamps[-1]:.3f} s"
            )
        if self.stamps and stamp == self.stamps[-1]:
            self.values[-1] = value
            return
        self.stamps.append(stamp)
        self.values.append(value)
        while len(self.stamps) > 2 and self.stamps[1] < stamp - self._span:
            self.stamps.popleft()
            self.values.popleft()

    def around(self, stamp: float) -> tuple[T, T, float]:
        """Return the values before and after a stamp, and its share of the way between them.

        Outside the series both are the first or the last value. There is at least one.
        """
        after = bisect_right(self.stamps, stamp)
        if after in (0, len(self.stamps)):
            end = self.values[0 if after == 0 else -1]
            return end, end, 0.0
        before = self.stamps[after - 1]
        share = (stamp - before) / (self.stamps[after] - before)
        return self.values[after - 1], self.values[after], share


DRIFT, SMALL = 0.3, 0.02
"""Metres and radians by which map -> odom may change in a second, or at all, and still have changed
on the way from one correction to the next: a loop that closes, or a pose that is set, changes it at
once."""


class TransformBuffer(FrameTree):
    """Tree of the frames map, odom and base, with the base's pose over the last `span` seconds.

    Planar code uses `pose_at`; `lookup` gives the same poses lifted from the plane.
    """

    def __init__(self, span: float = SPAN) -> None:
        super().__init__()
        self._odom_from_base: _Series[Odometry] = _Series(span)
        self._map_from_odom: _Series[tuple[Pose2D, bool]] = _Series(span)
        self._estimate: PoseEstimate | None = None
        self.follow("odom", "base", lambda stamp: lifted(self._odom_at(stamp)))
        self.follow("map", "odom", lambda stamp: lifted(self.map_from_odom(stamp)))

    @property
    def newest(self) -> float:
        """Stamp of the newest odometry, seconds.

        Raises:
            FrameError: there is none yet.
        """
        if not self._odom_from_base.stamps:
            raise FrameError("the transform buffer has no odometry yet")
        return self._odom_from_base.stamps[-1]

    def add(self, odometry: Odometry) -> None:
        """Add the pose of the base in the odom frame, with the error of the last step.

        Raises:
            FrameError: an older stamp than the last one.
        """
        self._odom_from_base.add(odometry.stamp, odometry)

    def correct(self, estimate: PoseEstimate) -> None:
        """Add the transform map -> odom of an estimate, valid from `estimate.corrected_at` on.

        After a correction faster than DRIFT, the transform is not interpolated with the one
        before. A correction by a measurement older than the last correction counts from then.
        """
        stamps = self._map_from_odom.stamps
        stamp = max(estimate.corrected_at, stamps[-1]) if stamps else estimate.corrected_at
        before = self._estimate
        passed = stamp - stamps[-1] if stamps else 0.0
        smooth = max(SMALL, DRIFT * passed)
        jumped = before is not None and has_jumped(before, estimate, smooth, smooth)
        if stamps and stamp == stamps[-1]:  # replaces the last one, which may have been a jump
            jumped = jumped or self._map_from_odom.values[-1][1]
        self._estimate = estimate
        self._map_from_odom.add(stamp, (estimate.map_from_odom, jumped))

    def pose_at(self, frame: Frame, stamp: float) -> Pose2D:
        """Return the pose of the base at a stamp.

        Between two odometry poses, the base is assumed to move at constant speed along a chord.

        Args:
            frame: in which the pose is expressed.
            stamp: seconds on the body's clock.

        Raises:
            FrameError: the stamp is outside the buffer, or the frame has no transform yet.
        """
        in_odom = self._odom_at(stamp)
        return in_odom if frame == "odom" else self.map_from_odom(stamp).compose(in_odom)

    def poses_at(self, stamps: FloatArray) -> FloatArray:
        """Return (n, 3) x, y and heading of the base at stamps (n,), odom frame.

        Raises:
            FrameError: a stamp is outside the buffer.
        """
        first, last = float(stamps.min()), float(stamps.max())
        self._check(first)
        self._check(last)
        poses = self._odom_from_base
        start = max(0, bisect_right(poses.stamps, first) - 1)
        end = bisect_right(poses.stamps, last) + 1
        known = list(islice(poses.stamps, start, end))
        steps = [step.pose for step in islice(poses.values, start, end)]
        found = np.empty((stamps.size, 3))
        found[:, 0] = np.interp(stamps, known, [pose.x for pose in steps])
        found[:, 1] = np.interp(stamps, known, [pose.y for pose in steps])
        found[:, 2] = np.interp(stamps, known, unwrapped([pose.heading for pose in steps]))
        found[:, 2] = (found[:, 2] + np.pi) % (2.0 * np.pi) - np.pi
        return found

    def map_from_odom(self, stamp: float) -> Pose2D:
        """Return the odom frame's pose in the map frame at a stamp.

        After the newest correction it is constant; before the oldest one, the oldest.

        Raises:
            FrameError: there is no estimate yet.
        """
        if not self._map_from_odom.stamps:
            raise FrameError("the transform buffer has no map -> odom yet")
        (before, _), (after, jumped), share = self._map_from_odom.around(stamp)
        return before if share == 0.0 or jumped else _between(before, after, share)

    def motion(self, since: float, until: float) -> Pose2D:
        """Return the base's pose at `until` in the base frame at `since`, by odometry.

        Raises:
            FrameError: a stamp is outside the buffer.
        """
        return self._odom_at(until).relative_to(self._odom_at(since))

    def motion_covariance(self, since: float, until: float) -> FloatArray:
        """Return the (3, 3) covariance of `motion(since, until)`: x, y, heading at `since`.

        The errors of the odometry's steps (`Odometry.step_covariance`) are independent and are
        propagated to first order: Σ = Σₖ Aₖ Qₖ Aₖᵀ, where Aₖ rotates the error of step k into the
        base frame at `since` and lets its heading error turn the rest of the motion. A part of a
        step has that part of its covariance. Zeros where the odometry states no error.

        Args:
            since: seconds on the body's clock.
            until: not before `since`, seconds.

        Raises:
            FrameError: a stamp is outside the buffer.
        """
        start, steps = self._steps_between(since, until)
        covariances = [step.step_covariance for step in steps]
        if not any(each is not NO_COVARIANCE and each.any() for each in covariances):
            return np.zeros((3, 3))
        first, last = self._odom_at(since), self._odom_at(until)
        shares = self._shares(start, len(steps), since, until)
        rows = np.array([_row(step.pose) for step in steps])
        end = last.relative_to(first)
        c, s = np.cos(first.heading), np.sin(first.heading)
        dx, dy = rows[:, 0] - first.x, rows[:, 1] - first.y
        heading = rows[:, 2] - first.heading
        spread = np.zeros((len(rows), 3, 3))
        spread[:, 0, 0] = spread[:, 1, 1] = np.cos(heading)
        spread[:, 1, 0], spread[:, 0, 1] = np.sin(heading), -np.sin(heading)
        spread[:, 0, 2] = -(end.y - (c * dy - s * dx))
        spread[:, 1, 2] = end.x - (c * dx + s * dy)
        spread[:, 2, 2] = 1.0
        errors = np.array(covariances) * shares[:, None, None]
        total: FloatArray = (spread @ errors @ spread.transpose(0, 2, 1)).sum(axis=0)
        return 0.5 * (total + total.T)

    def disturbed_between(self, since: float, until: float) -> bool:
        """Return whether the odometry was disturbed in a step that overlaps the interval.

        Args:
            since: seconds on the body's clock.
            until: not before `since`, seconds.

        Raises:
            FrameError: a stamp is outside the buffer.
        """
        return any(step.disturbed for step in self._steps_between(since, until)[1])

    def _steps_between(self, since: float, until: float) -> tuple[int, list[Odometry]]:
        """Return the odometry at the ends of steps in an interval, and the number of the first."""
        self._check(since)
        self._check(until)
        stamps = self._odom_from_base.stamps
        start = max(1, bisect_right(stamps, since))
        end = bisect_left(stamps, until) + 1
        return start, list(islice(self._odom_from_base.values, start, end))

    def _shares(self, start: int, count: int, since: float, until: float) -> FloatArray:
        """Return (count,) the part of the time of each step from `start` on in an interval."""
        stamps = self._odom_from_base.stamps
        known = np.array(list(islice(stamps, start - 1, start + count)))
        inside = np.minimum(known[1:], until) - np.maximum(known[:-1], since)
        shares: FloatArray = np.clip(inside / np.diff(known), 0.0, 1.0)
        return shares

    def covers(self, stamp: float) -> bool:
        """Return whether there is a pose in the odom frame at a stamp."""
        stamps = self._odom_from_base.stamps
        return bool(stamps) and stamps[0] - TOLERANCE <= stamp <= stamps[-1] + TOLERANCE

    def _check(self, stamp: float) -> None:
        if not self.covers(stamp):
            newest, oldest = self.newest, self._odom_from_base.stamps[0]
            raise FrameError(
                f"no pose at {stamp:.3f} s: the transform buffer covers"
                f" {oldest:.3f} s to {newest:.3f} s"
            )

    def _odom_at(self, stamp: float) -> Pose2D:
        self._check(stamp)
        before, after, share = self._odom_from_base.around(stamp)
        return before.pose if share == 0.0 else _between(before.pose, after.pose, share)


def _row(pose: Pose2D) -> tuple[float, float, float]:
    return pose.x, pose.y, pose.heading


def _between(before: Pose2D, after: Pose2D, share: float) -> Pose2D:
    """Interpolate positions on the chord and headings on the shorter way round."""
    turn = wrap_angle(after.heading - before.heading)
    return Pose2D(
        before.x + share * (after.x - before.x),
        before.y + share * (after.y - before.y),
        wrap_angle(before.heading + share * turn),
    )
