"""Short manoeuvres in tight places, where the path is clear but no arc to it is.

A sampled search like D. Fox, W. Burgard and S. Thrun, "The Dynamic Window Approach to Collision
Avoidance", IEEE Robotics & Automation Magazine 4(1), 1997, but over curvatures instead of
velocities, because in tight places the robot is slow enough for any curvature. It tries one motion
(an arc ahead), two (a short reverse or turn in place, then an arc ahead), and three.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import copysign, inf, pi

import numpy as np
from numpy.typing import NDArray

from stack.components import ControlState
from stack.control.swept import SweptFootprint
from stack.drivetrain.description import RobotDescription
from stack.drivetrain.kinematics import moved
from stack.geometry.path_segment import PathSegment
from stack.types import FloatArray, Pose2D, Twist, wrap_angle

CURVATURES_AHEAD = (0.0, 0.3, -0.3, 0.8, -0.8, 1.6, -1.6, 3.0, -3.0, 5.0, -5.0, 8.0, -8.0)
CURVATURES_BACK = (0.0, 1.0, -1.0, 3.0, -3.0)
"""Curvatures ahead and backward, 1/m; the largest are arcs much tighter than the robot's width."""

BACK_DISTANCES, TURNS = (0.1, 0.25), (0.12, -0.12, 0.3, -0.3, 0.6, -0.6, 1.0, -1.0)
"""Distances in metres of a first reverse, and angles in radians of a first turn in place."""

REACH, SHORTEST = 0.3, 0.08
"""Length of an arc ahead that is checked, and the length that must be clear, metres."""

MARGIN, TURN_MARGIN = 0.02, 0.05
"""Distance kept to an obstacle on an arc, metres, and at the end of a turn in place, radians."""

HEADING, PROGRESS, FIRST, REVERSE = 0.25, 0.6, 0.05, 0.3
"""Weights, in metres of offset from the path: per radian of heading error, per metre along the
path that is not driven, for a first motion, and per metre of reversing."""

LEAST_IMPROVEMENT = 0.03
"""Improvement in metres that a manoeuvre must bring."""

RETRY_AFTER = 0.5
"""Seconds until three motions are tried again after nothing was found: the search takes most of a
step (up to 40 ms), and little changes while the robot stands."""

HELD, HELD_SHARE = 0.5, 0.2
"""A robot is held when it drives for so many seconds at less than this share of the commanded
speed."""


@dataclass(frozen=True, slots=True)
class ArcPrimitive:
    """A motion with a constant twist, and its end pose.

    Attributes:
        twist: at 1 m/s, or at 1 rad/s for a turn in place.
        span: duration at this twist, seconds; equal to the metres or radians driven.
        end: end pose, map frame.
    """

    twist: Twist
    span: float
    end: Pose2D

    @staticmethod
    def of(begin: Pose2D, twist: Twist, span: float) -> ArcPrimitive:
        """Create the motion that begins at a pose."""
        return ArcPrimitive(twist, span, begin.compose(moved(twist, span)))

    def left(self, pose: Pose2D) -> float:
        """Remaining metres or radians for a robot near it; negative beyond its end."""
        if self.twist.linear:
            return copysign(1.0, self.twist.linear) * self.end.relative_to(pose).x
        return copysign(1.0, self.twist.angular) * wrap_angle(self.end.heading - pose.heading)


Motions = tuple[ArcPrimitive, ...]


@dataclass(frozen=True, slots=True)
class _Begun:
    """First motions that are clear: k of them, of one or two motions each.

    Attributes:
        ends: (k, 3) x, y, heading at their ends, map frame.
        motions: (k, d) rows of the table of first motions.
        prices: (k,) metres.
    """

    ends: FloatArray
    motions: NDArray[np.int64]
    prices: FloatArray


@dataclass(frozen=True, slots=True)
class _Found:
    """The arcs ahead from k first motions, n each.

    Attributes:
        begun: the first motions.
        ways: (k, n) metres that are clear.
        errors: (k, n) of the poses at their ends, metres; inf: not clear far enough.
    """

    begun: _Begun
    ways: FloatArray
    errors: FloatArray

    @property
    def costs(self) -> FloatArray:
        """(k, n) errors with the price of the first motions, metres."""
        return self.errors + self.begun.prices[:, np.newaxis]


class Manoeuvres:
    """Finds manoeuvres for one robot.

    Args:
        swept: collision checks of the robot's footprint.
        robot: gives the turning radius and whether it can reverse.
    """

    def __init__(self, swept: SweptFootprint, robot: RobotDescription) -> None:
        self._swept = swept
        tightest = 1.0 / robot.turning_radius if robot.turning_radius else inf
        back = [
            (-1.0, curvature, distance)
            for curvature in CURVATURES_BACK
            for distance in BACK_DISTANCES
            if robot.limits.reverse_speed > 0.0 and abs(curvature) <= tightest
        ]
        turns = [] if robot.turning_radius else [(0.0, copysign(1.0, a), abs(a)) for a in TURNS]
        firsts = np.array([*turns, *back]).reshape(-1, 3)
        self._first_twists, self._first_spans = _twists(firsts[:, :2]), firsts[:, 2]
        self._reverses = firsts[:, 0] != 0.0
        self._first_reaches = self._first_spans + np.where(self._reverses, MARGIN, TURN_MARGIN)
        self._prices = FIRST + REVERSE * np.where(self._reverses, self._first_spans, 0.0)
        ahead = [(1.0, curvature) for curvature in CURVATURES_AHEAD if abs(curvature) <= tightest]
        self._arcs = _twists(np.array(ahead))
        self._reaches = np.full(len(ahead), REACH + MARGIN)
        self._found_nothing: tuple[PathSegment, float] | None = None

    def ahead(self, state: ControlState, segment: PathSegment) -> ArcPrimitive | None:
        """The clear arc ahead that ends nearest to the path, if it leads on at all."""
        here = _row(state.pose)
        ways, ends = self._ahead(state, here)
        better = _path_errors(ends[0], segment) < _path_errors(here, segment)
        arcs = [
            ArcPrimitive.of(state.pose, _twist(twist), float(way))
            for twist, way, leads_on in zip(self._arcs, ways[0], better, strict=True)
            if way >= SHORTEST and leads_on
        ]
        return min(arcs, key=lambda arc: _end_error(arc, segment), default=None)

    def around(self, state: ControlState, segment: PathSegment) -> Motions:
        """A short reverse or turn, then an arc ahead; empty when nothing improves the pose.

        When no such pair is worth its price, three motions are tried, as in a turn in three moves:
        whatever improves the pose is better than to stand.
        """
        here = _row(state.pose)
        limit = float(_path_errors(here, segment)[0]) - LEAST_IMPROVEMENT
        once = self._begin(state, _Begun(here, np.empty((1, 0), np.int64), np.zeros(1)))
        pairs = self._with_arcs(state, segment, once)
        if pairs.errors.size and pairs.costs.min() < limit:
            return self._motions(state.pose, pairs, pairs.costs)
        if self._found_nothing and self._found_nothing[0] is segment:
            if 0.0 <= state.time - self._found_nothing[1] < RETRY_AFTER:
                return ()
        threes = self._with_arcs(state, segment, self._begin(state, once))
        better = [np.where(some.errors < limit, some.costs, inf) for some in (pairs, threes)]
        least = [float(costs.min(initial=inf)) for costs in better]
        if min(least) == inf:
            self._found_nothing = segment, state.time
            return ()
        self._found_nothing = None
        chosen = 0 if least[0] <= least[1] else 1
        return self._motions(state.pose, (pairs, threes)[chosen], better[chosen])

    def room(self, state: ControlState, arc: ArcPrimitive) -> float:
        """Metres or radians that are clear on the rest of an arc, at most what is left of it."""
        left = max(0.0, arc.left(state.pose))
        return min(left, self._swept.arc(state.costs, state.pose, arc.twist, left)[0])

    def _begin(self, state: ControlState, begun: _Begun) -> _Begun:
        """Every first motion after others, if clear; a turn after a turn would be one turn."""
        free = self._swept.free_times(
            state.costs, begun.ends, self._first_twists, self._first_reaches
        )
        clear = free == inf
        if begun.motions.shape[1]:
            clear &= self._reverses[begun.motions[:, -1]][:, np.newaxis] | self._reverses
        before, motion = np.nonzero(clear)
        ends = _ends(begun.ends, self._first_twists, self._first_spans)
        return _Begun(
            ends[before, motion],
            np.column_stack([begun.motions[before], motion]),
            begun.prices[before] + self._prices[motion],
        )

    def _with_arcs(self, state: ControlState, segment: PathSegment, begun: _Begun) -> _Found:
        ways, ends = self._ahead(state, begun.ends)
        errors = _path_errors(ends.reshape(-1, 3), segment).reshape(ways.shape)
        return _Found(begun, ways, np.where(ways >= SHORTEST, errors, inf))

    def _ahead(self, state: ControlState, begins: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(k, n) metres that are clear on the arcs ahead, <= REACH, and their (k, n, 3) ends."""
        free = self._swept.free_times(state.costs, begins, self._arcs, self._reaches)
        ways = np.clip(free - MARGIN, 0.0, REACH)
        return ways, _ends(begins, self._arcs, ways)

    def _motions(self, pose: Pose2D, found: _Found, costs: FloatArray) -> Motions:
        """The motions of least cost."""
        begun, arc = np.unravel_index(np.argmin(costs), costs.shape)
        firsts = [
            (self._first_twists[motion], self._first_spans[motion])
            for motion in found.begun.motions[begun]
        ]
        motions: list[ArcPrimitive] = []
        for twist, span in [*firsts, (self._arcs[arc], found.ways[begun, arc])]:
            motions.append(ArcPrimitive.of(pose, _twist(twist), float(span)))
            pose = motions[-1].end
        return tuple(motions)


class HoldDetector:
    """Tells that something holds the robot: usually the safety stage, before an obstacle.

    Args:
        period: seconds between two steps.
    """

    def __init__(self, period: float) -> None:
        self._most, self._steps = round(HELD / period), 0

    @property
    def is_held(self) -> bool:
        """Whether the robot has hardly followed its commands for a while."""
        return self._steps >= self._most

    def reset(self) -> None:
        """Begin again, for another motion."""
        self._steps = 0

    def update(self, commanded: Twist, measured: Twist) -> None:
        """Compare the last command of a step with the velocity after it."""
        wanted, speed = commanded.linear, measured.linear
        if not wanted:
            wanted, speed = commanded.angular, measured.angular
        self._steps = self._steps + 1 if abs(speed) < HELD_SHARE * abs(wanted) else 0


def _row(pose: Pose2D) -> FloatArray:
    return np.array([[pose.x, pose.y, pose.heading]])


def _twists(linear_and_angular: FloatArray) -> FloatArray:
    """(n, 3) twists without lateral velocity."""
    return np.ascontiguousarray(np.insert(linear_and_angular, 1, 0.0, axis=1))


def _twist(row: FloatArray) -> Twist:
    return Twist(float(row[0]), float(row[2]))


def _ends(begins: FloatArray, twists: FloatArray, spans: FloatArray) -> FloatArray:
    """(k, n, 3) poses after n twists from k poses, for (n,) or (k, n) seconds; as `moved`."""
    half = 0.5 * twists[:, 2] * spans
    chord = twists[:, 0] * spans * np.sinc(half / pi)
    x, y, heading = (begins[:, axis, np.newaxis] for axis in range(3))
    ends = np.empty((len(begins), len(twists), 3))
    ends[:, :, 0] = x + chord * np.cos(heading + half)
    ends[:, :, 1] = y + chord * np.sin(heading + half)
    ends[:, :, 2] = heading + 2.0 * half
    return ends


def _end_error(arc: ArcPrimitive, segment: PathSegment) -> float:
    """Error of an arc's end against the path pose after the same length, metres."""
    there = segment.pose_ahead(arc.span)
    turn = abs(wrap_angle(arc.end.heading - there.heading))
    return arc.end.distance_to(there) + HEADING * turn - PROGRESS * arc.span


def _path_errors(poses: FloatArray, segment: PathSegment) -> FloatArray:
    """(k,) errors of poses (k, 3) against the path, less their progress along it, metres."""
    length, offset, heading = segment.feet(np.ascontiguousarray(poses[:, :2])).T
    turn = np.abs((poses[:, 2] - heading + pi) % (2.0 * pi) - pi)
    errors: FloatArray = offset + HEADING * turn - PROGRESS * (length - segment.travelled)
    return errors
