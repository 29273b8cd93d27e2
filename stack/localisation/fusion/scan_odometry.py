"""Scan matching as a source of the odometry filter: keyframes, and whether wheels agree."""

from __future__ import annotations

from itertools import takewhile
from math import cos, hypot, inf, sin, sqrt

import numpy as np

from stack.localisation.fusion import kernels
from stack.localisation.fusion.history import History, Motion, Node
from stack.localisation.fusion.measurements import NewKeyframe, RelativePose, StateMeasurement
from stack.localisation.fusion.scan_matching.matcher import MATCHING_POINTS, ScanMatch, ScanMatcher
from stack.localisation.planar import as_row
from stack.types import FloatArray, Pose2D, Scan

GATE = 4.0
"""Mahalanobis distance of a scan match from the wheels beyond which they disagree."""
JUMP_SPEED_DEVIATION = 0.2
"""Standard deviation of the wheels' velocity after a push was found; it may go on, m/s."""
SUDDEN_SHARE = 0.3
"""The robot was pushed if its predicted pose explains so much less of a scan than the last match
did."""
KEYFRAME_DISTANCE = 0.5
"""Distance from the keyframe at which the next one is set, m."""
KEYFRAME_ANGLE = 0.6
"""Rotation from the keyframe at which the next one is set, rad."""
KEYFRAME_SHARE = 0.75
"""The next keyframe is set if a match explains less of the points."""
LOST_MATCHES = 15
"""After so many scans without a match a new keyframe is set."""

SOURCE = "scan matching"

SETTLED_DISTANCE, SETTLED_ANGLE, SETTLED_SHARE = 0.015, 0.03, 0.3
"""A disturbed robot's wheels agree with a match within m, rad, and this share of the motion."""

REMEMBERED = 0.3
"""Seconds for which a match reduces the stated error of the steps after it."""

REPEATED = 5
"""Matches whose mean squared distance is compared with the gate: small slip adds up."""


class ScanOdometry:
    """Matches each scan to the last keyframe and updates the filter with the result.

    Args:
        noise: standard deviation of a range of the lidar, metres.
    """

    def __init__(self, noise: float) -> None:
        self._matcher = ScanMatcher(noise)
        self._last = self._seen = -inf
        self._matched = Pose2D(0.0, 0.0)
        self._missed = 0
        self._distances: list[float] = []
        self._remaining = np.ones(3)

    def remaining(self, now: float) -> FloatArray | None:
        """Return (3,) the share of the deviation of a step along x, y, heading that matches leave.

        None without a match in the last REMEMBERED seconds.
        """
        return None if now - self._last > REMEMBERED else self._remaining

    def fuse(self, scan: Scan, history: History, *, disturbed: bool) -> bool:
        """Update the filter with a scan; return whether the wheels contradict it.

        Args:
            scan: not deskewed.
            history: of the filter.
            disturbed: whether wheels are not used now.
        """
        begin = scan.stamp - 0.5 * scan.time_increment * (scan.ranges.size - 1)
        node = history.at(scan.stamp)
        if node is None or begin < history.oldest_stamp - 1e-9:
            return False
        if scan.stamp <= self._seen:
            return False
        points = self._matcher.points_of(scan, _trail(history, scan, node))
        if self._matcher.keyframe is None:
            self._set_keyframe(points, history, scan.stamp)
            return False
        matched, since = self._matched, self._seen

        def by_wheels() -> Pose2D:
            return matched.compose(_by_wheels(history, since, scan.stamp))

        keyframe = Pose2D(*node.state[kernels.KEYFRAME :].tolist())
        predicted = as_row(node.pose.relative_to(keyframe))
        match = self._matcher.match(points, predicted, lambda: as_row(by_wheels()))
        self._seen = scan.stamp
        if match is None:
            self._matched = by_wheels()
            return self._miss(points, history, scan.stamp, disturbed)
        contradicted = self._update(match, history, scan.stamp, disturbed)
        self._missed, self._last = 0, scan.stamp
        self._matched = Pose2D(*match.pose.tolist())
        if not contradicted and self._is_far(match):
            self._set_keyframe(points, history, scan.stamp)
        return contradicted

    def _update(self, match: ScanMatch, history: History, stamp: float, disturbed: bool) -> bool:
        prior = history.motion_error(self._last, stamp)
        gate = inf if disturbed else GATE
        added = history.add(RelativePose(stamp, SOURCE, match.pose, match.covariance, gate))
        assert added is not None
        contradicted = False
        if disturbed:
            contradicted = not self._wheels_agree(history, stamp)
        elif added.distance > GATE or self._is_biased(added.distance):
            history.disturb(self._last)
            self._distances.clear()
            contradicted = True
            if added.distance > GATE:
                history.replace(added, RelativePose(stamp, SOURCE, match.pose, match.covariance))
        if match.searched:
            history.add(_at_wheel_speed(history, stamp, JUMP_SPEED_DEVIATION))
        self._remaining = _share_left(prior, match.covariance, match.pose[2])
        return contradicted

    def _is_biased(self, distance: float) -> bool:
        """Whether the last matches differ from the wheels by more than chance.

        The sum of n squared distances of three degrees of freedom has the mean 3 n and the
        variance 6 n.
        """
        self._distances = [*self._distances, distance * distance][-REPEATED:]
        limit = 3.0 * REPEATED + GATE * (6.0 * REPEATED) ** 0.5
        return len(self._distances) == REPEATED and sum(self._distances) > limit

    def _wheels_agree(self, history: History, stamp: float) -> bool:
        """Whether the wheels show the motion between the last two matches."""
        first, last = history.at(self._last), history.at(stamp)
        if first is None or last is None:
            return False
        moved = last.pose.relative_to(first.pose)
        wheels = _by_wheels(history, self._last, stamp)
        off = wheels.relative_to(moved)
        tolerance = SETTLED_DISTANCE + SETTLED_SHARE * hypot(wheels.x, wheels.y)
        angle = SETTLED_ANGLE + SETTLED_SHARE * abs(wheels.heading)
        return hypot(off.x, off.y) < tolerance and abs(off.heading) < angle

    def _miss(self, points: FloatArray, history: History, stamp: float, disturbed: bool) -> bool:
        """Count a scan without a match; after too many the scan is the next keyframe.

        If the one before matched well, the view has changed at once: the robot may be elsewhere.
        """
        self._missed += 1
        if self._missed >= LOST_MATCHES:
            self._set_keyframe(points, history, stamp)
            return False
        sudden = self._matcher.last_share - SUDDEN_SHARE
        return disturbed or self._matcher.expected_share < sudden

    def _is_far(self, match: ScanMatch) -> bool:
        x, y, heading = match.pose.tolist()
        far = hypot(x, y) > KEYFRAME_DISTANCE or abs(heading) > KEYFRAME_ANGLE
        return far or match.share < KEYFRAME_SHARE

    def _set_keyframe(self, points: FloatArray, history: History, stamp: float) -> None:
        if points.shape[0] >= MATCHING_POINTS // 10:
            self._matcher.set_keyframe(points)
            self._last = self._seen = stamp
            self._matched, self._missed = Pose2D(0.0, 0.0), 0
            history.add(NewKeyframe(stamp, SOURCE + " keyframe"))


def _at_wheel_speed(history: History, stamp: float, deviation: float) -> StateMeasurement:
    """Return the wheels' velocity at a stamp as a measurement: a jump has no velocity of its own.

    It is weak: the push may go on.
    """
    parts = (kernels.TWIST, kernels.TWIST + 1)
    speed = np.zeros(2)
    for node in history.nodes:
        motion = node.event
        if isinstance(motion, Motion) and node.key[0] <= stamp + 1e-9:
            speed = motion.given[kernels.FORWARD : kernels.TURN] / motion.given[kernels.DURATION]
    variance = np.eye(2) * deviation**2
    return StateMeasurement(stamp, SOURCE + " jump", parts, speed, variance)


def _by_wheels(history: History, since: float, until: float) -> Pose2D:
    """Return the motion between two stamps by wheels and gyro; identity before the history."""
    moved = Pose2D(0.0, 0.0)
    recent = takewhile(lambda node: node.key[0] > since + 1e-9, reversed(history.nodes))
    for node in reversed(list(recent)):
        motion = node.event
        if isinstance(motion, Motion) and node.key[0] <= until + 1e-9:
            share = (motion.end - motion.begin) / float(motion.given[kernels.DURATION])
            ahead, left, turn = (share * motion.given[kernels.FORWARD : kernels.TURN + 1]).tolist()
            if motion.given[kernels.HAS_GYRO] > 0.0:
                bias = float(node.state[kernels.BIAS])
                turn = share * float(motion.given[kernels.ROTATION])
                turn -= bias * (motion.end - motion.begin)
            c, s = cos(0.5 * turn), sin(0.5 * turn)
            moved = moved.compose(Pose2D(c * ahead - s * left, s * ahead + c * left, turn))
    return moved


def _trail(history: History, scan: Scan, node: Node) -> FloatArray:
    """Return (m, 4) stamps and poses around a scan, in the base frame at its stamp."""
    reach = 0.5 * scan.time_increment * scan.ranges.size
    x, y, heading = node.state[:3].tolist()
    c, s = cos(heading), sin(heading)
    rows: list[tuple[float, float, float, float]] = []
    for known in reversed(history.nodes):
        stamp = known.key[0]
        if rows and rows[-1][0] == stamp:
            continue
        if stamp > scan.stamp + reach and rows:
            rows.pop()
        x_there, y_there, turned = known.state[:3].tolist()
        dx, dy = x_there - x, y_there - y
        rows.append((stamp, c * dx + s * dy, c * dy - s * dx, turned - heading))
        if stamp < scan.stamp - reach:
            break
    return np.array(rows[::-1])


def _share_left(prior: FloatArray, match: FloatArray, heading: float) -> FloatArray:
    """Return (3,) the share of the prior's deviation that remains after the match.

    A displacement between two matches has twice the variance of one.
    """
    c, s = cos(heading), sin(heading)
    (xx, xy, _), (_, yy, _), (_, _, turning) = match.tolist()
    variances = (
        c * c * xx + 2.0 * c * s * xy + s * s * yy, s * s * xx - 2.0 * c * s * xy + c * c * yy,
        turning,
    )  # fmt: skip
    own = prior.diagonal().tolist()
    return np.array([
        sqrt(2.0 * variance / (2.0 * variance + before))
        for variance, before in zip(variances, own, strict=True)
    ])  # fmt: skip
