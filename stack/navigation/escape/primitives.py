"""Short motions to choose from: arcs, turns in place and straight lines, by kind of drive.

A motion is a row of legs; each leg is driven with one twist. Sampled densely enough, its poses
stand for the whole sweep of the outline (J. Barraquand, J.-C. Latombe, "Nonholonomic multibody
mobile robots", 1991, searches with such a set as well).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import copysign, cos, hypot, pi, radians, sin

import numpy as np

from stack.drivetrain.description import DriveKind, RobotDescription
from stack.types import FloatArray, Pose2D, Twist

SPACING = 0.02
"""Metres that no point of the outline moves farther than between two sampled poses."""

CURVATURES = (0.0, 0.8, -0.8, 1.6, -1.6, 3.0, -3.0)
"""Of arcs, 1/m."""

TURN_STEPS = (5, 2)
"""Degrees between the turns in place before driving straight: coarse ones first, fine ones where
these find nothing. Out of a niche with 5 cm to spare on both sides a robot half a metre long gets
within 3 deg of its axis."""

NUDGES = (0.1, 0.2, 0.3)
"""Metres of a first leg that makes room for the second."""

DIRECTIONS = 24
"""In which an omnidirectional robot may set off."""


@dataclass(frozen=True, slots=True)
class EscapeSegment:
    """One twist driven for a while.

    Attributes:
        twist: per unit of `amount`.
        amount: metres of the base's way, or radians of a turn in place.
    """

    twist: Twist
    amount: float

    @property
    def turns(self) -> bool:
        """Whether it is a turn in place."""
        return not (self.twist.linear or self.twist.lateral)

    def come(self, step: Pose2D) -> float:
        """How much of it a step of the base makes: where it led, seen from where it began."""
        if self.turns:
            return step.heading * copysign(1.0, self.twist.angular)
        along = step.x * self.twist.linear + step.y * self.twist.lateral
        return along / hypot(self.twist.linear, self.twist.lateral)


@dataclass(frozen=True, slots=True)
class Rollout:
    """The poses of a motion, from a start that is not among them.

    Attributes:
        poses: (k, 3) x, y, heading.
        leg: (k,) number of the leg that each belongs to.
        amount: (k,) of that leg driven there.
        length: (k,) metres driven until there.
        turned: (k,) radians turned in place until there.
    """

    poses: FloatArray
    leg: FloatArray
    amount: FloatArray
    length: FloatArray
    turned: FloatArray


def roll_out(start: Pose2D, legs: Sequence[EscapeSegment], radius: float) -> Rollout:
    """Sample the legs from a pose on.

    Args:
        start: in any fixed frame.
        legs: to drive in turn.
        radius: of the circle that holds the outline, metres.
    """
    parts, length, turned = [], 0.0, 0.0
    for number, leg in enumerate(legs):
        rim = hypot(leg.twist.linear, leg.twist.lateral) + abs(leg.twist.angular) * radius
        count = max(1, int(np.ceil(leg.amount * rim / SPACING)))
        amounts = np.linspace(0.0, leg.amount, count + 1)[1:]
        poses = _along(start, leg.twist, amounts)
        driven = np.zeros(count) if leg.turns else amounts
        spun = amounts if leg.turns else np.zeros(count)
        columns = (np.full(count, number), amounts, length + driven, turned + spun)
        parts.append(np.column_stack([poses, *columns]))
        length, turned = length + float(driven[-1]), turned + float(spun[-1])
        start = Pose2D(*map(float, poses[-1]))
    rows = np.concatenate(parts)
    return Rollout(np.ascontiguousarray(rows[:, :3]), *rows[:, 3:].T)


def _along(start: Pose2D, twist: Twist, amounts: FloatArray) -> FloatArray:
    """(k, 3) poses after driving a twist for each of the amounts (k,)."""
    half = 0.5 * twist.angular * amounts
    chord = amounts * np.sinc(half / pi)
    c, s = np.cos(start.heading + half), np.sin(start.heading + half)
    return np.column_stack(
        [
            start.x + chord * (c * twist.linear - s * twist.lateral),
            start.y + chord * (s * twist.linear + c * twist.lateral),
            start.heading + 2.0 * half,
        ]
    )


def motions(
    robot: RobotDescription, length: float, fine: bool = False
) -> list[tuple[EscapeSegment, ...]]:
    """The set to choose from; each may be ended early.

    Args:
        robot: whose drive has to make them.
        length: of the longest leg, metres.
        fine: the rest of the set, for where the first has nothing.
    """
    if robot.turning_radius:
        return [] if fine else list(_car(robot, length))
    turns = _turns(robot, TURN_STEPS[fine])
    straight: list[tuple[EscapeSegment, ...]] = [
        (_turn(a), EscapeSegment(Twist(sign), length)) for a in turns for sign in _signs(robot)
    ]
    if fine:
        return straight
    own = _omnidirectional if robot.drive is DriveKind.OMNI else _differential
    return [*own(robot, length), *straight]


def _signs(robot: RobotDescription) -> tuple[float, ...]:
    return (1.0, -1.0) if robot.limits.reverse_speed > 0.0 else (1.0,)


def _turns(robot: RobotDescription, step: int) -> list[int]:
    """Degrees, either way, less first; who can reverse need not turn more than a quarter."""
    most = 90 if robot.limits.reverse_speed > 0.0 else 180
    return [sign * degrees for degrees in range(step, most + 1, step) for sign in (1, -1)]


def _arc(sign: float, curvature: float, length: float) -> EscapeSegment:
    """An arc of at most half a turn, forward or backward; curvature is to the left of its way."""
    longest = min(length, pi / abs(curvature)) if curvature else length
    return EscapeSegment(Twist(sign, curvature), longest)


def _differential(robot: RobotDescription, length: float) -> Iterator[tuple[EscapeSegment, ...]]:
    for sign in _signs(robot):
        for curvature in CURVATURES:
            yield (_arc(sign, curvature, length),)
    for first in _signs(robot):
        for nudge in NUDGES:
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
            for nudge in NUDGES:
                for second in curvatures:
                    yield _arc(sign, curvature, nudge), _arc(-sign, second, length)


def _omnidirectional(robot: RobotDescription, length: float) -> Iterator[tuple[EscapeSegment, ...]]:
    for number in range(DIRECTIONS):
        angle = number * 2.0 * pi / DIRECTIONS
        if robot.limits.reverse_speed > 0.0 or cos(angle) > -1e-9:
            yield (EscapeSegment(Twist(cos(angle), 0.0, sin(angle)), length),)


def _turn(degrees: float) -> EscapeSegment:
    return EscapeSegment(Twist(angular=copysign(1.0, degrees)), radians(abs(degrees)))
