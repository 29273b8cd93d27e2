"""Chooses the motion that leads to the most room."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from stack.drivetrain.description import RobotDescription
from stack.navigation.escape.primitives import EscapeSegment, Rollout, motions, roll_out
from stack.navigation.escape.surroundings import Surroundings
from stack.types import FloatArray, Pose2D

Motion = tuple[bool, int]
"""Whether it is of the fine set, and its number there."""

OUTLINE_SPACING = 0.03
"""Metres between the points of the outline that must lie on known ground."""

WIDENED = 0.01
"""Metres round the trail that count as driven through: half a step of it."""

NOISE = 0.03
"""Metres that a beam may fall short of what it shows: three deviations of a usual lidar."""

LEAST_WEIGHT, LENGTH_WEIGHT, TURN_WEIGHT = 0.5, 0.04, 0.01
"""Of the least clearance on the way, a metre and a radian, against a metre of clearance gained."""

LITTLE = 0.1
"""Metres that a robot can drive if it is not shut in."""

SLACK = 0.005
"""Metres by which the robot may come nearer than the padding, where it stands nearer already."""


@dataclass(frozen=True, slots=True)
class EscapeCriteria:
    """What is looked for.

    Attributes:
        clearance: enough room round the outline, metres.
        padding: that is to stay free on the way, metres, where it is free now.
        gain: metres of clearance that make a motion worth while.
        length: metres to drive at most.
    """

    clearance: float
    padding: float
    gain: float
    length: float


@dataclass(frozen=True, slots=True)
class Way:
    """A motion chosen.

    Attributes:
        motion: which it is.
        legs: cut off where it is to end.
        clearance: expected at its end, metres.
        floor: clearance that it keeps to, metres.
    """

    motion: Motion
    legs: tuple[EscapeSegment, ...]
    clearance: float
    floor: float


class Search:
    """Sweeps the outline along each motion over what is known of the surroundings.

    The outline is the robot's polygon, at poses 2 cm apart at its rim: it may not come nearer to
    a point of the scan than the padding, nor leave the ground that was seen or driven through.

    Args:
        robot: outline and drive.
        surroundings: looked at anew for each question.
    """

    def __init__(self, robot: RobotDescription, surroundings: Surroundings) -> None:
        from stack.navigation.escape import kernels

        self._kernels, self._robot, self._surroundings = kernels, robot, surroundings
        self._corners = np.ascontiguousarray(robot.footprint.points, dtype=np.float64)
        self._radius = robot.footprint.circumscribed_radius
        self._outline = _resampled(self._corners, OUTLINE_SPACING)
        lengths = np.linalg.norm(self._corners, axis=1, keepdims=True)
        self._widened = self._corners * (1.0 + WIDENED / lengths)

    def clearance(self, pose: Pose2D, reach: float) -> float:
        """Metres between the outline and the nearest point, at most `reach`; negative inside."""
        here = np.array([[pose.x, pose.y, pose.heading]])
        points = self._surroundings.points(pose, self._radius + reach)
        return float(self._clearances(here, points, reach)[0])

    def best(
        self, start: Pose2D, criteria: EscapeCriteria, banned: Collection[Motion] = ()
    ) -> Way | None:
        """The motion to the most room; None when none leads to more than there is here.

        Args:
            start: odom frame.
            criteria: what is looked for.
            banned: motions that have turned out not to go.
        """
        coarse = self._best(start, criteria, banned, fine=False)
        return coarse or self._best(start, criteria, banned, fine=True)

    def _best(
        self, start: Pose2D, criteria: EscapeCriteria, banned: Collection[Motion], *, fine: bool
    ) -> Way | None:
        points = self._surroundings.points(start, criteria.length + 2.0 * self._radius)
        now = self.clearance(start, criteria.clearance)
        floor = min(criteria.padding, now - SLACK)
        best, found = -np.inf, None
        for number, legs in enumerate(motions(self._robot, criteria.length, fine)):
            if (fine, number) in banned:
                continue
            rollout = roll_out(start, legs, self._radius)
            clear = self._clearances(rollout.poses, points, criteria.clearance, floor)
            score = _scores(rollout, clear, criteria, now)
            if score.max(initial=-np.inf) <= best:
                continue
            score = score[: self._known_until(rollout.poses[: len(score)])]
            end = int(score.argmax()) if len(score) else 0
            if len(score) and score[end] > best:
                best, cut = float(score[end]), _cut(legs, rollout, end)
                found = Way((fine, number), cut, float(clear[end]), floor)
        return found

    def can_leave(self, start: Pose2D, padding: float) -> bool:
        """Whether the robot can drive any way for a little, more room or not.

        Args:
            start: odom frame.
            padding: as in a wish.
        """
        points = self._surroundings.points(start, LITTLE + 2.0 * self._radius)
        floor = min(padding, self.clearance(start, padding) - SLACK)
        for legs in motions(self._robot, LITTLE):
            if len(legs) == 1:
                poses = roll_out(start, legs, self._radius).poses
                clear = self._clearances(poses, points, padding, floor)
                if len(clear) == len(poses) and self._known_until(poses) == len(poses):
                    return True
        return False

    def clear(self, start: Pose2D, way: Way, legs: tuple[EscapeSegment, ...]) -> bool:
        """Whether what is left of a way is still as clear as it was chosen for.

        Args:
            start: where the robot is, odom frame.
            way: as it was chosen.
            legs: what is left of it.
        """
        poses = roll_out(start, legs, self._radius).poses
        length = sum(leg.amount for leg in legs if not leg.turns)
        points = self._surroundings.points(start, length + 2.0 * self._radius)
        floor = min(way.floor, self.clearance(start, NOISE)) - NOISE / 2.0
        clear = self._clearances(poses, points, NOISE, floor)
        return len(clear) == len(poses) and self._known_until(poses) == len(poses)

    def _clearances(
        self, poses: FloatArray, points: FloatArray, reach: float, floor: float = -np.inf
    ) -> FloatArray:
        """(n,) metres round the outline at each pose, up to the first that is below the floor."""
        out = np.empty(len(poses))
        count = self._kernels.clearances(
            poses, points, self._corners, self._radius, reach, floor, out
        )
        return out[:count]

    def _known_until(self, poses: FloatArray) -> int:
        views = self._surroundings.views
        scan = views[-1].scan
        same = [view for view in views if view.scan.ranges.shape == scan.ranges.shape]
        sensors = np.array([(v.sensor.x, v.sensor.y, v.sensor.heading) for v in same])
        ranges = np.array([view.scan.ranges for view in same], dtype=np.float64)
        reaches = np.minimum(ranges, scan.range_max) + NOISE  # NaN stays: it shows nothing
        return int(
            self._kernels.known_until(
                poses, self._outline, sensors, reaches, scan.angle_min, scan.angle_increment,
                self._surroundings.trail, self._widened,
            )
        )  # fmt: skip


def _scores(
    rollout: Rollout, clear: FloatArray, criteria: EscapeCriteria, now: float
) -> FloatArray:
    """(n,) worth of ending at each of the first n poses; -inf where it gains too little.

    Clearance gained at the end counts most, then the least on the way, then a short way.
    """
    least, count = np.minimum.accumulate(clear), len(clear)
    scores: FloatArray = (
        clear
        + LEAST_WEIGHT * np.minimum(least, criteria.padding)
        - LENGTH_WEIGHT * rollout.length[:count]
        - TURN_WEIGHT * rollout.turned[:count]
    )
    scores[clear < min(now + criteria.gain, criteria.clearance)] = -np.inf
    return scores


def _cut(legs: tuple[EscapeSegment, ...], rollout: Rollout, end: int) -> tuple[EscapeSegment, ...]:
    """The legs up to a pose of the roll-out."""
    last = int(rollout.leg[end])
    return *legs[:last], replace(legs[last], amount=float(rollout.amount[end]))


def _resampled(corners: FloatArray, spacing: float) -> FloatArray:
    """(m, 2) points along the edges of a polygon."""
    edges = zip(corners, np.roll(corners, -1, axis=0), strict=True)
    return np.vstack(
        [
            np.linspace(a, b, 1 + int(np.ceil(np.linalg.norm(b - a) / spacing)), endpoint=False)
            for a, b in edges
        ]
    )
