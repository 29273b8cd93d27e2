"""Motion primitives of the escape search: arcs, turns in place and straight lines, by drive.

A motion is a sequence of segments, each with one twist. Its poses are sampled densely enough to
represent the swept outline (compare J. Barraquand, J.-C. Latombe, "Nonholonomic multibody mobile
robots", 1991).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import copysign, cos, hypot, pi, radians, sin

import numpy as np

from stack.drivetrain.description import RobotDescription
from stack.drivetrain.kinematics import swept_poses
from stack.types import FloatArray, Pose2D, Twist

SAMPLE_SPACING = 0.02
"""Maximum motion of any point of the outline between two sampled poses, metres."""

CURVATURES = (0.0, 0.8, -0.8, 1.6, -1.6, 3.0, -3.0)
"""Curvatures of arcs, 1/m."""

GENTLE_CURVATURES = (0.3, -0.3, 0.1, -0.1, 0.04, -0.04)
"""Curvatures tried where no other motion is clear, 1/m. A box that leaves a wall beside it on an
arc of curvature k comes nearer by k L² / 2 with its rear corner, L behind the base."""

TURN_STEPS = (5, 2)
"""Steps of the turns in place before driving straight, degrees: coarse; fine if these fail.

To leave a niche with 5 cm of room on both sides, a robot half a metre long must be aligned with its
axis within 3 deg.
"""

NUDGE_LENGTHS = (0.1, 0.2, 0.3)
"""Lengths of a first segment that makes room for the second, metres."""

START_DIRECTIONS = 24
"""Number of directions in which an omnidirectional robot may start."""


@dataclass(frozen=True, slots=True)
class EscapeSegment:
    """Part of a motion with a constant twist.

    Attributes:
        twist: per unit of `amount`.
        amount: metres driven by the base, or radians of a turn in place.
    """

    twist: Twist
    amount: float

    @property
    def turns(self) -> bool:
        """Whether it is a turn in place."""
        return not (self.twist.linear or self.twist.lateral)

    def driven(self, step: Pose2D) -> float:
        """Return the amount driven by a step of the base (end pose relative to start pose)."""
        if self.turns:
            return step.heading * copysign(1.0, self.twist.angular)
        along = step.x * self.twist.linear + step.y * self.twist.lateral
        return along / hypot(self.twist.linear, self.twist.lateral)


@dataclass(frozen=True, slots=True)
class Rollout:
    """Sampled poses of a motion, without its start.

    Attributes:
        poses: (k, 3) x, y, heading.
        segment: (k,) index of the segment of each pose.
        amount: (k,) amount of that segment driven at the pose.
        length: (k,) metres driven up to the pose.
        turned: (k,) radians turned in place up to the pose.
    """

    poses: FloatArray
    segment: FloatArray
    amount: FloatArray
    length: FloatArray
    turned: FloatArray


def roll_out(start: Pose2D, segments: Sequence[EscapeSegment], radius: float) -> Rollout:
    """Sample the poses of segments.

    Args:
        start: start pose in any fixed frame.
        segments: driven one after another.
        radius: circumscribed radius of the outline, metres.
    """
    parts, length, turned = [], 0.0, 0.0
    for number, segment in enumerate(segments):
        amounts, poses = swept_poses(start, segment.twist, segment.amount, radius, SAMPLE_SPACING)
        count = len(amounts)
        driven = np.zeros(count) if segment.turns else amounts
        spun = amounts if segment.turns else np.zeros(count)
        columns = (np.full(count, number), amounts, length + driven, turned + spun)
        parts.append(np.column_stack([poses, *columns]))
        length, turned = length + float(driven[-1]), turned + float(spun[-1])
        start = Pose2D(*map(float, poses[-1]))
    rows = np.concatenate(parts)
    return Rollout(np.ascontiguousarray(rows[:, :3]), *rows[:, 3:].T)


def motions(
    robot: RobotDescription, length: float, fine: bool = False
) -> list[tuple[EscapeSegment, ...]]:
    """Return the motions of the search; each may end early.

    Args:
        robot: its drive limits the motions.
        length: of the longest segment, metres.
        fine: return the fine turns, for use when the coarse set has no solution.
    """
    if not robot.drivetrain.turns_in_place:
        return [] if fine else list(_car(robot, length))
    turns = _turns(robot, TURN_STEPS[fine])
    straight: list[tuple[EscapeSegment, ...]] = [
        (_turn(a), EscapeSegment(Twist(sign), length)) for a in turns for sign in _signs(robot)
    ]
    if fine:
        arcs = [(_arc(sign, k, length),) for sign in _signs(robot) for k in GENTLE_CURVATURES]
        return [*straight, *arcs]
    own = _omnidirectional if robot.drivetrain.can_move_sideways else _differential
    return [*own(robot, length), *straight]


def _signs(robot: RobotDescription) -> tuple[float, ...]:
    return (1.0, -1.0) if robot.limits.reverse_speed > 0.0 else (1.0,)


def _turns(robot: RobotDescription, step: int) -> list[int]:
    """Turning angles in degrees, small ones first; at most 90 for robots that can reverse."""
    most = 90 if robot.limits.reverse_speed > 0.0 else 180
    return [sign * degrees for degrees in range(step, most + 1, step) for sign in (1, -1)]


def _arc(sign: float, curvature: float, length: float) -> EscapeSegment:
    """Return an arc of at most half a turn, forward or backward; positive curvature turns left."""
    longest = min(length, pi / abs(curvature)) if curvature else length
    return EscapeSegment(Twist(sign, curvature), longest)


def _differential(robot: RobotDescription, length: float) -> Iterator[tuple[EscapeSegment, ...]]:
    for sign in _signs(robot):
        for curvature in CURVATURES:
            yield (_arc(sign, curvature, length),)
    for first in _signs(robot):
        for nudge in NUDGE_LENGTHS:
            for degrees in (45, -45, 90, -90, 135, -135):
                yield (
                    EscapeSegment(Twist(first), nudge),
                    _turn(degrees),
                    EscapeSegment(Twist(1.0), length),
                )


def _car(robot: RobotDescription, length: float) -> Iterator[tuple[EscapeSegment, ...]]:
    tightest = 1.0 / robot.turning_radius
    curvatures = (0.0, 0.5 * tightest, -0.5 * tightest, tightest, -tightest)
    for sign in _signs(robot):
        for curvature in curvatures:
            yield (_arc(sign, curvature, length),)
            if len(_signs(robot)) == 1:
                continue
            for nudge in NUDGE_LENGTHS:
                for second in curvatures:
                    yield _arc(sign, curvature, nudge), _arc(-sign, second, length)


def _omnidirectional(robot: RobotDescription, length: float) -> Iterator[tuple[EscapeSegment, ...]]:
    for number in range(START_DIRECTIONS):
        angle = number * 2.0 * pi / START_DIRECTIONS
        if robot.limits.reverse_speed > 0.0 or cos(angle) > -1e-9:
            yield (EscapeSegment(Twist(cos(angle), 0.0, sin(angle)), length),)


def _turn(degrees: float) -> EscapeSegment:
    return EscapeSegment(Twist(angular=copysign(1.0, degrees)), radians(abs(degrees)))
