"""Steering along a centre line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import atan, atan2, copysign, cos, inf, sin

import numpy as np

from stack.types import FloatArray, Pose2D, Twist, wrap_angle

BEHIND, AHEAD, AHEAD_TIME = 0.12, 0.1, 0.4
"""Line to which a parabola is fitted: metres behind the robot, and metres and seconds ahead."""

CORNER, CORNER_AHEAD = 0.1, 0.35
"""Metres of line over which its curvature is measured, and metres ahead in which this is done, so
that the robot is slow enough at corners."""

CORNER_BRAKING = 0.4
"""m/s² before a corner."""

CURVE_SHARE = 0.6
"""Share of the fastest turn that the line's curvature may need; the rest is for corrections."""

LINE_STEP = 0.02
"""Metres from point to point of the line."""

KEPT_BEHIND = 25
"""Points of line behind the robot that are kept: 50 cm."""

STIFFNESS, DAMPING = 14.0, 5.3
"""1/m² and 1/m; e'' = -STIFFNESS e - DAMPING e' along the line: damping ratio 0.7, and an error
halves within 0.35 m."""

LARGEST_ERROR = 0.25
"""Metres; larger errors are steered like this one, so that the line is met at 30 degrees."""

CUT_OFF = 3
"""Points at the end of a line that leaves what was seen; its edge cuts the line askew there."""

BENT, TIGHTEST = 0.5, 2.5
"""A line that leaves what was seen is expected to bend on as in its last 0.5 m, at most 2.5/m."""

FASTEST_TURN = 1.2
LARGEST_ANGLE = 0.9
"""Radians between robot and line beyond which it turns in place."""

SWEEP, SWEEP_SPEED = 1.9, 0.6
"""Radians turned to each side in search of a line; rad/s."""

CURVE_SPEED = 0.12
"""m/s in the tightest curves."""


@dataclass(frozen=True)
class LineOffset:
    """Where a line is, seen from the robot.

    Attributes:
        error: distance to the line, metres, positive if it is on the left.
        angle: of the line in the base frame, radians.
        curvature: 1/m, positive to the left.
    """

    error: float
    angle: float
    curvature: float


class CentreLine:
    """A line to follow, and how far along it the robot is.

    Args:
        points: (n, 2) odom frame, n >= 2.
    """

    def __init__(self, points: FloatArray) -> None:
        self.points = _resampled(points)
        self._at = 0

    @property
    def length(self) -> float:
        """Metres."""
        return LINE_STEP * (len(self.points) - 1)

    @property
    def remaining(self) -> float:
        """Metres from the robot to the end."""
        return self.length - LINE_STEP * self._at

    @property
    def here(self) -> FloatArray:
        """(2,) the point next to the robot, odom frame."""
        here: FloatArray = self.points[self._at]
        return here

    @property
    def passed(self) -> FloatArray:
        """(n, 2) the line up to the robot, odom frame."""
        return self.points[: self._at + 1]

    def distance(self, point: FloatArray) -> float:
        """Return the distance from a point (odom frame) to the line, metres."""
        return float(np.linalg.norm(self.points - point, axis=1).min())

    def heading(self, distance: float = 0.0) -> float:
        """Return the line's direction at a distance ahead of the robot, odom frame, radians."""
        at = min(max(self._at + round(distance / LINE_STEP), 2), len(self.points) - 3)
        first, last = self.points[max(at - 2, 0)], self.points[min(at + 2, len(self.points) - 1)]
        return atan2(last[1] - first[1], last[0] - first[0])

    def advance(self, robot: Pose2D) -> None:
        """Move on to the point next to the robot (odom frame); never back by more than 10 cm."""
        first = max(self._at - 5, 0)
        near = self.points[first : self._at + 20] - [robot.x, robot.y]
        self._at = first + int(np.argmin((near**2).sum(axis=1)))

    def speed_limit(self) -> float:
        """Return the speed at which the robot can follow the curves just ahead, m/s."""
        first = max(self._at - round(BEHIND / LINE_STEP), 0)
        last = self._at + round(CORNER_AHEAD / LINE_STEP)
        steps = np.diff(self.points[first : last + 1], axis=0)
        across = round(CORNER / LINE_STEP)
        if len(steps) <= across:
            return inf
        headings = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
        bends = np.abs(headings[across:] - headings[:-across]) / CORNER
        there = np.maximum(CURVE_SPEED, CURVE_SHARE * FASTEST_TURN / np.maximum(bends, 1e-3))
        away = LINE_STEP * (np.arange(len(bends)) + first - self._at)
        return float(np.sqrt(there**2 + 2.0 * CORNER_BRAKING * np.maximum(away, 0.0)).min())

    def offset(self, robot: Pose2D, speed: float) -> LineOffset:
        """Return where the line is, seen from a pose near the robot's (odom frame).

        Args:
            robot: odom frame.
            speed: m/s; a faster robot looks farther ahead.
        """
        first = max(self._at - round(BEHIND / LINE_STEP), 0)
        last = min(self._at + round((AHEAD + AHEAD_TIME * speed) / LINE_STEP), len(self.points) - 1)
        points = robot.inverse().transform(self.points[first : last + 1])
        chord = points[-1] - points[0]
        along = atan2(chord[1], chord[0])
        turned = Pose2D(0.0, 0.0, along).inverse().transform(points)
        if len(points) < 6:
            return LineOffset(float(turned[:, 1].mean()), along, 0.0)
        bend, slope, error = np.polyfit(turned[:, 0], turned[:, 1], 2)
        angle = wrap_angle(along + atan(slope))
        curvature = 2.0 * bend / (1.0 + slope**2) ** 1.5
        return LineOffset(float(error * cos(atan(slope))), angle, float(curvature))


def steer(offset: LineOffset, speed: float) -> Twist:
    """Return the velocity that leads onto a line and along it.

    The turn rate is the speed times the line's curvature and a second-order feedback of distance
    and angle. Far off its direction the robot turns in place.
    """
    if abs(offset.angle) > LARGEST_ANGLE:
        return Twist(0.0, FASTEST_TURN if offset.angle > 0.0 else -FASTEST_TURN)
    error = min(max(offset.error, -LARGEST_ERROR), LARGEST_ERROR)
    bend = offset.curvature + STIFFNESS * error + DAMPING * sin(offset.angle)
    linear = min(speed, max(CURVE_SPEED, FASTEST_TURN / max(abs(bend), 1e-3)))
    return Twist(linear, min(max(linear * bend, -FASTEST_TURN), FASTEST_TURN))


class Sweep:
    """Turn to one side and back to the other, in search of a line.

    Args:
        heading: of the robot, radians.
        side: where to begin, 1: left, -1: right.
    """

    def __init__(self, heading: float, side: int) -> None:
        self._heading, self._turned = heading, 0.0
        self._goals = [side * SWEEP, -side * SWEEP]

    def command(self, heading: float) -> Twist | None:
        """Return the velocity, given the heading now; None after both turns."""
        self._turned += wrap_angle(heading - self._heading)
        self._heading = heading
        while self._goals and abs(self._goals[0] - self._turned) < 0.1:
            self._goals.pop(0)
        if not self._goals:
            return None
        return Twist(0.0, copysign(SWEEP_SPEED, self._goals[0] - self._turned))


def extended(
    points: FloatArray, length: float, *, curved: bool, corners: Sequence[FloatArray] = ()
) -> FloatArray:
    """Return a line that goes on for some metres: straight, or bent as its last 50 cm are.

    Args:
        points: (n, 2) metres.
        length: metres.
        curved: whether it is bent; its last points, at the edge of what was seen, are left out.
        corners: (2,) each, junctions; what is before them says nothing about the bend.
    """
    line = _resampled(points)
    if curved and len(line) > 2 * CUT_OFF:
        line = line[:-CUT_OFF]
    away = [np.linalg.norm(line - corner, axis=1) for corner in corners]
    after = max((int(one.argmin()) for one in away if one.min() < CORNER), default=0)
    last, curvature = _end_of(line[min(after, len(line) - 5) :])
    if not curved:
        curvature = 0.0
    along = np.arange(1.0, length / LINE_STEP)
    headings = last + curvature * LINE_STEP * (along - 0.5)
    beyond = line[-1] + LINE_STEP * np.cumsum(
        np.column_stack([np.cos(headings), np.sin(headings)]), axis=0
    )
    return np.concatenate([line, beyond])


def _end_of(line: FloatArray) -> tuple[float, float]:
    """Return direction (radians) and curvature (1/m) at the end of a line, by a parabola."""
    last = line[-round(BENT / LINE_STEP) :]
    chord = last[-1] - last[0]
    along = atan2(chord[1], chord[0])
    if len(last) < 10:
        return along, 0.0
    turned = Pose2D(float(last[-1, 0]), float(last[-1, 1]), along).inverse().transform(last)
    bend, slope, _ = np.polyfit(turned[:, 0], turned[:, 1], 2)
    curvature = 2.0 * float(bend) / (1.0 + float(slope) ** 2) ** 1.5
    return along + atan(float(slope)), min(max(curvature, -TIGHTEST), TIGHTEST)


def approach(robot: Pose2D, line: FloatArray) -> FloatArray:
    """Return a curve (n, 2) from the robot's pose to the first point of a line, into its direction.

    A cubic Hermite curve, odom frame.
    """
    point, towards = line[0], line[min(5, len(line) - 1)] - line[0]
    heading = atan2(towards[1], towards[0])
    start = np.array([robot.x, robot.y])
    distance = float(np.linalg.norm(point - start))
    share = np.linspace(0.0, 1.0, max(3, round(distance / LINE_STEP)))[:, None]
    first = distance * np.array([cos(robot.heading), sin(robot.heading)])
    last = distance * np.array([cos(heading), sin(heading)])
    curve: FloatArray = (
        (2.0 * share**3 - 3.0 * share**2 + 1.0) * start
        + (share**3 - 2.0 * share**2 + share) * first
        + (3.0 * share**2 - 2.0 * share**3) * point
        + (share**3 - share**2) * last
    )
    return curve


def _resampled(points: FloatArray) -> FloatArray:
    """Return a polyline smoothed over 10 cm with points LINE_STEP apart."""
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    points = points[np.concatenate([[True], steps > 1e-6])]
    along = np.concatenate([[0.0], np.cumsum(steps[steps > 1e-6])])
    even = np.arange(0.0, along[-1] + 0.5 * LINE_STEP, LINE_STEP)
    resampled = np.column_stack([np.interp(even, along, points[:, axis]) for axis in (0, 1)])
    if len(resampled) < 3:
        return resampled
    padded = np.concatenate([
        2.0 * resampled[0] - resampled[2:0:-1], resampled,
        2.0 * resampled[-1] - resampled[-2:-4:-1],
    ])  # fmt: skip
    kernel = np.full(5, 0.2)
    return np.column_stack([np.convolve(padded[:, axis], kernel, "valid") for axis in (0, 1)])
