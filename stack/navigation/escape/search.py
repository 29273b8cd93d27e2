"""Search of the motion that leads to the most clearance."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from stack.drivetrain.description import RobotDescription
from stack.geometry.polygons import outline_points
from stack.navigation.escape.primitives import EscapeSegment, Rollout, motions, roll_out
from stack.navigation.escape.surroundings import Surroundings
from stack.types import FloatArray, Pose2D

MotionId = tuple[bool, int]
"""Whether the motion is from the fine set, and its index there."""

ESCAPE_PADDING = 0.03
"""Distance kept around the footprint in an escape, if free now, m."""

LEAST_GAIN = 0.02
"""Minimum gain of clearance by a motion, metres: more than the noise of a lidar."""

OUTLINE_SPACING = 0.03
"""Metres between the outline points that must be on known ground."""

TRAIL_MARGIN = 0.01
"""Metres around the trail that count as driven through: half a step of the trail."""

RANGE_NOISE = 0.03
"""Range error of a beam, metres: three standard deviations of a typical lidar."""

LEAST_WEIGHT, LENGTH_WEIGHT, TURN_WEIGHT = 0.5, 0.04, 0.01
"""Weights of the minimum clearance, of a metre driven and of a radian turned, relative to a metre
of clearance at the end."""

ENCLOSED_BELOW = 0.1
"""Metres that the robot must be able to drive to count as not enclosed."""

PADDING_SLACK = 0.005
"""Metres by which a robot that is already inside the padding may come nearer."""

TIGHT, LATERAL = 0.02, 0.02
"""Clearance in metres that a robot beside the padding may use up, and by how much: in a narrow gap
the nearest direction of the motion set leads closer to one side."""

NO_FENCE: FloatArray = np.empty((0, 2))
NO_FENCE.flags.writeable = False


@dataclass(frozen=True, slots=True)
class ChosenMotion:
    """The best motion of a search.

    Attributes:
        motion: its identification.
        segments: cut at the end of the motion.
        floor: minimum clearance during the motion, metres.
    """

    motion: MotionId
    segments: tuple[EscapeSegment, ...]
    floor: float


class EscapeSearch:
    """Sweeps the outline along each motion and checks it against the known surroundings.

    The outline is the robot's polygon, at poses that move it by at most 2 cm: it must keep the
    padding to every obstacle point, and stay on ground that was seen or driven through.

    Args:
        robot: outline and drive.
        surroundings: read at each call.
        fence: (m, 2) points that count as obstacles although no sensor sees them, odom frame.
    """

    def __init__(
        self, robot: RobotDescription, surroundings: Surroundings, fence: FloatArray = NO_FENCE
    ) -> None:
        from stack.navigation.escape import kernels

        self._kernels, self._robot, self._surroundings = kernels, robot, surroundings
        self._fence = fence
        self._corners = np.ascontiguousarray(robot.footprint.points, dtype=np.float64)
        self._radius = robot.footprint.circumscribed_radius
        self._outline = outline_points(self._corners, OUTLINE_SPACING)
        lengths = np.linalg.norm(self._corners, axis=1, keepdims=True)
        self._widened = self._corners * (1.0 + TRAIL_MARGIN / lengths)

    def _points(self, centre: Pose2D, reach: float) -> FloatArray:
        """Return the (m, 2) obstacle points around a pose, those of the fence too, odom frame."""
        seen = self._surroundings.points(centre, reach)
        away = np.hypot(self._fence[:, 0] - centre.x, self._fence[:, 1] - centre.y)
        return np.concatenate([seen, self._fence[away <= reach]]) if len(away) else seen

    def clearance(self, pose: Pose2D, reach: float) -> float:
        """Metres between the outline and the nearest point, at most `reach`; negative inside."""
        here = np.array([[pose.x, pose.y, pose.heading]])
        points = self._points(pose, self._radius + reach)
        return float(self._clearances(here, points, reach)[0])

    def best(
        self, start: Pose2D, clearance: float, length: float, banned: Collection[MotionId] = ()
    ) -> ChosenMotion | None:
        """Return the motion to the most clearance; None when none improves it.

        Args:
            start: current pose, odom frame.
            clearance: sufficient clearance around the outline, metres.
            length: maximum distance to drive, metres.
            banned: motions that have stalled.
        """
        coarse = self._best(start, clearance, length, banned, fine=False)
        return coarse or self._best(start, clearance, length, banned, fine=True)

    def _best(
        self, start: Pose2D, clearance: float, length: float, banned: Collection[MotionId], *,
        fine: bool,
    ) -> ChosenMotion | None:  # fmt: skip
        clearance += LEAST_GAIN
        points = self._points(start, length + 2.0 * self._radius)
        now = self.clearance(start, clearance)
        floor = _floor(now)
        best, found = -np.inf, None
        for number, segments in enumerate(motions(self._robot, length, fine)):
            if (fine, number) in banned:
                continue
            rollout = roll_out(start, segments, self._radius)
            clear = self._clearances(rollout.poses, points, clearance, floor)
            score = _scores(rollout, clear, min(now + LEAST_GAIN, clearance))
            if score.max(initial=-np.inf) <= best:
                continue
            score = score[: self._known_until(rollout.poses[: len(score)])]
            end = int(score.argmax()) if len(score) else 0
            if len(score) and score[end] > best:
                best = float(score[end])
                found = ChosenMotion((fine, number), _cut(segments, rollout, end), floor)
        return found

    def can_leave(self, start: Pose2D) -> bool:
        """Whether the robot can drive a short distance in any direction from a pose, odom frame."""
        points = self._points(start, ENCLOSED_BELOW + 2.0 * self._radius)
        floor = _floor(self.clearance(start, ESCAPE_PADDING + LATERAL))
        for segments in motions(self._robot, ENCLOSED_BELOW):
            if len(segments) == 1:
                poses = roll_out(start, segments, self._radius).poses
                clear = self._clearances(poses, points, ESCAPE_PADDING, floor)
                if len(clear) == len(poses) and self._known_until(poses) == len(poses):
                    return True
        return False

    def clear(
        self, start: Pose2D, chosen: ChosenMotion, segments: tuple[EscapeSegment, ...]
    ) -> bool:
        """Whether the rest of a motion is still clear.

        Args:
            start: current pose, odom frame.
            chosen: the motion.
            segments: its remaining segments.
        """
        poses = roll_out(start, segments, self._radius).poses
        length = sum(segment.amount for segment in segments if not segment.turns)
        points = self._points(start, length + 2.0 * self._radius)
        floor = min(chosen.floor, self.clearance(start, RANGE_NOISE)) - RANGE_NOISE / 2.0
        clear = self._clearances(poses, points, RANGE_NOISE, floor)
        return len(clear) == len(poses) and self._known_until(poses) == len(poses)

    def _clearances(
        self, poses: FloatArray, points: FloatArray, reach: float, floor: float = -np.inf
    ) -> FloatArray:
        """(n,) clearances in metres at the poses, up to the first one below the floor."""
        out = np.empty(len(poses))
        count = self._kernels.clearances(
            poses, points, self._corners, self._radius, reach, floor, out
        )
        return out[:count]

    def _known_until(self, poses: FloatArray) -> int:
        views = self._surroundings.views
        longest = max(view.ranges.size for view in views)
        sensors, reaches = np.empty((len(views), 6)), np.full((len(views), longest), np.nan)
        for row, view in enumerate(views):
            sensor, count = view.sensor, view.ranges.size
            sensors[row] = (
                sensor.x, sensor.y, sensor.heading, view.angle_min, view.angle_increment, count
            )  # fmt: skip
            reaches[row, :count] = np.minimum(view.ranges, view.range_max) + RANGE_NOISE
        return int(
            self._kernels.known_until(
                poses, self._outline, sensors, reaches, self._surroundings.trail, self._widened
            )
        )


def _floor(clearance: float) -> float:
    """Metres that a motion must keep free, for a robot with this clearance now."""
    return min(ESCAPE_PADDING, clearance - PADDING_SLACK, max(TIGHT, clearance - LATERAL))


def _scores(rollout: Rollout, clear: FloatArray, enough: float) -> FloatArray:
    """Return (n,) scores of ending at each of the first n poses; -inf with too little clearance.

    Clearance at the end counts most, then the minimum clearance, then a short motion.
    """
    least, count = np.minimum.accumulate(clear), len(clear)
    scores: FloatArray = (
        clear
        + LEAST_WEIGHT * np.minimum(least, ESCAPE_PADDING)
        - LENGTH_WEIGHT * rollout.length[:count]
        - TURN_WEIGHT * rollout.turned[:count]
    )
    scores[clear < enough] = -np.inf
    return scores


def _cut(
    segments: tuple[EscapeSegment, ...], rollout: Rollout, end: int
) -> tuple[EscapeSegment, ...]:
    """Return the segments up to a pose of the rollout."""
    last = int(rollout.segment[end])
    return *segments[:last], replace(segments[last], amount=float(rollout.amount[end]))
