"""Short manoeuvres in tight places, where the path is clear but no arc to it is.

A sampled search like D. Fox, W. Burgard and S. Thrun, "The Dynamic Window Approach to Collision
Avoidance", IEEE Robotics & Automation Magazine 4(1), 1997, but over curvatures instead of
velocities, because in tight places the robot is slow enough for any curvature. It tries one motion
(an arc ahead), two (a short reverse or turn in place, then an arc ahead), and three.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import copysign, inf
from typing import NamedTuple

from stack.components import ControlState
from stack.control.swept import SweptFootprint
from stack.drivetrain.description import RobotDescription
from stack.drivetrain.kinematics import moved
from stack.geometry.path_segment import PathSegment
from stack.types import Pose2D, Twist, wrap_angle

AHEAD = (0.0, 0.3, -0.3, 0.8, -0.8, 1.6, -1.6, 3.0, -3.0, 5.0, -5.0, 8.0, -8.0)
BACK = (0.0, 1.0, -1.0, 3.0, -3.0)
"""Curvatures ahead and backward, 1/m; the largest are arcs much tighter than the robot's width."""

BACK_DISTANCES, TURNS = (0.1, 0.25), (0.12, -0.12, 0.3, -0.3, 0.6, -0.6, 1.0, -1.0)
"""Distances in metres of a first reverse, and angles in radians of a first turn in place."""

REACH, SHORTEST = 0.3, 0.08
"""Length of an arc ahead that is checked, and the length that must be clear, metres."""

MARGIN = 0.02
"""Distance kept to an obstacle on an arc, metres."""

HEADING, PROGRESS, FIRST, REVERSE = 0.25, 0.6, 0.05, 0.3
"""Weights, in metres of offset from the path: per radian of heading error, per metre along the
path that is not driven, for a first motion, and per metre of reversing."""

GAIN = 0.03
"""Improvement in metres that a manoeuvre must bring."""


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


class _Manoeuvre(NamedTuple):
    """Motions, the error of the pose at their end, and the error with their price, metres."""

    cost: float
    error: float
    motions: Motions


_NONE = _Manoeuvre(inf, inf, ())


class Manoeuvres:
    """Finds manoeuvres for one robot.

    Args:
        swept: collision checks of the robot's footprint.
        robot: gives the turning radius and whether it can reverse.
    """

    def __init__(self, swept: SweptFootprint, robot: RobotDescription) -> None:
        self._swept = swept
        tightest = 1.0 / robot.turning_radius if robot.turning_radius else inf
        reverses = robot.limits.reverse_speed > 0.0
        self._arcs = [curvature for curvature in AHEAD if abs(curvature) <= tightest]
        self._back = [curvature for curvature in BACK if reverses and abs(curvature) <= tightest]
        self._turns = () if robot.turning_radius else TURNS

    def ahead(self, state: ControlState, segment: PathSegment) -> ArcPrimitive | None:
        """The clear arc ahead that ends nearest to the path."""
        arcs = self._ahead(state, state.pose)
        return min(arcs, key=lambda arc: _end_error(arc, segment), default=None)

    def around(self, state: ControlState, segment: PathSegment) -> Motions:
        """A short reverse or turn, then an arc ahead; empty when nothing improves the pose.

        When no such pair is worth its price, three motions are tried, as in a turn in three moves:
        whatever improves the pose is better than to stand.
        """
        once = [((first,), _price(first)) for first in self._first(state, state.pose)]
        limit = _path_error(state.pose, segment) - GAIN
        pairs = self._with_arcs(state, segment, once)
        best = min(pairs, key=_cost, default=_NONE)
        if best.cost < limit:
            return best.motions
        twice = [
            ((first, second), price + _price(second))
            for (first,), price in once
            for second in self._first(state, first.end)
            if first.twist.linear or second.twist.linear
        ]
        both = [*pairs, *self._with_arcs(state, segment, twice)]
        better = (found for found in both if found.error < limit)
        return min(better, key=_cost, default=_NONE).motions

    def _with_arcs(
        self, state: ControlState, segment: PathSegment, begun: Sequence[tuple[Motions, float]]
    ) -> list[_Manoeuvre]:
        """First motions with their price, and the clear arcs ahead from their ends."""
        found = []
        for firsts, price in begun:
            for arc in self._ahead(state, firsts[-1].end):
                error = _path_error(arc.end, segment)
                found.append(_Manoeuvre(error + price, error, (*firsts, arc)))
        return found

    def is_clear(self, state: ControlState, arc: ArcPrimitive) -> bool:
        """Whether the rest of an arc is clear."""
        left = arc.left(state.pose)
        return left <= 0.0 or self._free(state, state.pose, arc.twist, left) == inf

    def _ahead(self, state: ControlState, begin: Pose2D) -> Iterator[ArcPrimitive]:
        for curvature in self._arcs:
            twist = Twist(1.0, curvature)
            way = min(self._free(state, begin, twist, REACH + MARGIN) - MARGIN, REACH)
            if way >= SHORTEST:
                yield ArcPrimitive.of(begin, twist, way)

    def _first(self, state: ControlState, begin: Pose2D) -> Iterator[ArcPrimitive]:
        for angle in self._turns:
            turn = Twist(angular=copysign(1.0, angle))
            if self._free(state, begin, turn, abs(angle) + 0.05) == inf:
                yield ArcPrimitive.of(begin, turn, abs(angle))
        for curvature in self._back:
            twist = Twist(-1.0, curvature)
            free = self._free(state, begin, twist, BACK_DISTANCES[-1] + MARGIN)
            for distance in BACK_DISTANCES:
                if free >= distance + MARGIN:
                    yield ArcPrimitive.of(begin, twist, distance)

    def _free(self, state: ControlState, pose: Pose2D, twist: Twist, reach: float) -> float:
        free, _ = self._swept.arc(state.costs, pose, twist, reach)
        return free


def _cost(manoeuvre: _Manoeuvre) -> float:
    return manoeuvre.cost


def _price(first: ArcPrimitive) -> float:
    return FIRST + (REVERSE * first.span if first.twist.linear else 0.0)


def _end_error(arc: ArcPrimitive, segment: PathSegment) -> float:
    """Error of an arc's end against the path pose after the same length, metres."""
    there = segment.pose_ahead(arc.span)
    turn = abs(wrap_angle(arc.end.heading - there.heading))
    return arc.end.distance_to(there) + HEADING * turn - PROGRESS * arc.span


def _path_error(pose: Pose2D, segment: PathSegment) -> float:
    """Error of a pose against the path, less its progress along it, metres."""
    length, offset, heading = segment.foot(pose)
    turn = abs(wrap_angle(pose.heading - heading))
    return offset + HEADING * turn - PROGRESS * (length - segment.travelled)
