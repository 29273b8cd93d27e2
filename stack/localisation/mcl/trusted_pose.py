"""The pose that was trusted before a push: what it says about places that fit equally well."""

from __future__ import annotations

from collections.abc import Sequence
from math import exp, hypot, inf, log

from stack.types import Pose2D, wrap_angle

PUSH_DISTANCE = 0.7
"""Standard deviation of the displacement by a push that odometry notices; ranks places that fit
equally well, m."""
PUSH_ANGLE = 0.6
"""Standard deviation of the rotation by such a push, rad."""
LIFTED_SHARE = 0.3
"""After a push, probability of a place far from the trusted pose, relative to one at it; 1: the
trusted pose counts for nothing."""
CARRIED_SHARE = 0.003
"""After a touch, probability of a place far from the trusted pose, relative to one at it; below
RIVAL_SHARE, so that such a place is no rival."""

_SLIP = 0.1
"""Error of odometry since then, as a share of the distance driven: wheels may have slipped."""

_UNNOTICED_SHARE = 0.99
"""LIFTED_SHARE without a push that odometry states: only decides between equal places."""

_TOUCHED_ANGLE = 0.3
"""Radians; deviation of the rotation by who walks into the robot and stays there: a gyro measures
it, and wheels on the floor allow little."""

_TURNED_SHARE = 0.005
"""Factor of CARRIED_SHARE at another heading: people who walk into a robot repeatedly can push it
along a corridor by metres, but not turn it round unnoticed."""

_TOUCH_COUNTS = 2.0
"""Metres driven for which a touch counts, although the pose is trusted: in a corridor a push along
it does not show until its end comes near."""

_NEAR = 1.5
"""Deviations of a push within which an estimate is the pushed pose."""

_FARTHEST = 30.0
"""Square of the deviations from which on all places are as far away."""


class TrustedPose:
    """The last trusted pose, moved by odometry, and whether a push has displaced the robot since.

    A push moves a robot by decimetres, and wheels or inertial sensor show that it happened. A
    robot that is lifted shows nothing and may be anywhere. So the pose makes other places less
    probable only after a push that odometry states. As odometry may take a lift for a push, every
    place keeps at least LIFTED_SHARE of the probability that it has without the trusted pose.
    Without such a push, the pose only decides which of equally probable places is the estimate:
    odometry by wheels alone notices no push. If the scans show that something touched the robot,
    it was pushed and not lifted: CARRIED_SHARE takes the place of LIFTED_SHARE, and a place far
    away with another heading is less probable still: of two equal rooms that face each other, the
    heading tells which one it is.
    """

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """Trust no pose."""
        self._pose: Pose2D | None = None
        self._pushed, self._untouched = False, inf

    def trust(self, pose: Pose2D, odometry: Pose2D) -> None:
        """Trust a pose in the map frame, at a pose in the odom frame."""
        self._pose, self._odometry, self._driven = pose, odometry, 0.0
        self._pushed = False

    def drive(self, distance: float, *, pushed: bool, touched: bool = False) -> None:
        """Add a distance by odometry.

        Args:
            distance: metres.
            pushed: whether odometry was disturbed on the way.
            touched: whether something touched the robot on the way.
        """
        if self._pose is not None:
            self._driven += distance
            self._pushed = self._pushed or pushed
        self._untouched = 0.0 if touched else self._untouched + distance

    def follow(self, pose: Pose2D, odometry: Pose2D) -> None:
        """Continue from an estimate that is near the expected pose, if something touches the robot.

        Who walks into a robot pushes it on and on: each of its places is near the one before.

        Args:
            pose: estimate, map frame.
            odometry: at that pose, odom frame.
        """
        if self._pose is None or not self.is_touched:
            return
        expected = self._expected(odometry)
        away = expected.distance_to(pose) / PUSH_DISTANCE
        turned = abs(wrap_angle(pose.heading - expected.heading)) / self._angle()
        if max(away, turned) < _NEAR:
            self._pose, self._odometry, self._driven = pose, odometry, 0.0

    @property
    def is_touched(self) -> bool:
        """Whether something touched the robot not long ago."""
        return self._untouched < _TOUCH_COUNTS

    def _angle(self) -> float:
        """Return the standard deviation of the heading."""
        angle = PUSH_ANGLE
        return min(angle, _TOUCHED_ANGLE) if self.is_touched else angle

    def _expected(self, odometry: Pose2D) -> Pose2D:
        """Return the trusted pose, moved by odometry."""
        assert self._pose is not None
        return self._pose.compose(odometry.relative_to(self._odometry))

    def log_priors(self, poses: Sequence[Pose2D], odometry: Pose2D) -> list[float]:
        """Return the log-probability of each pose, relative to the most probable one: at most 0.

        A normal distribution about the expected pose with the deviations PUSH_DISTANCE and
        PUSH_ANGLE, mixed with LIFTED_SHARE of a constant one; after a touch, with
        CARRIED_SHARE of one that is constant in the place only.

        Args:
            poses: base, map frame.
            odometry: at these poses, odom frame.
        """
        if self._pose is None:
            return [0.0] * len(poses)
        expected, angle = self._expected(odometry), self._angle()
        across = hypot(PUSH_DISTANCE, _SLIP * self._driven)
        lifted = LIFTED_SHARE if self._pushed else _UNNOTICED_SHARE
        lifted = CARRIED_SHARE if self.is_touched else lifted
        found = []
        for pose in poses:
            away = expected.distance_to(pose) / across
            turned = wrap_angle(pose.heading - expected.heading) / angle
            near = exp(-0.5 * min(away * away + turned * turned, _FARTHEST))
            far = lifted
            if self.is_touched:
                aligned = exp(-0.5 * min(turned * turned, _FARTHEST))
                far *= _TURNED_SHARE + (1.0 - _TURNED_SHARE) * aligned
            found.append(log(far + (1.0 - lifted) * near))
        return found
