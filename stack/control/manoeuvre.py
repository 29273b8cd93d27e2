"""Short motions in tight places, where no arc to the path is clear though the path itself is.

A sampled search in the manner of D. Fox, W. Burgard and S. Thrun, "The Dynamic Window Approach to
Collision Avoidance", IEEE Robotics & Automation Magazine 4(1), 1997, over curvatures instead of
velocities (in tight places the robot is slow enough for any), and two motions deep: an arc ahead,
or a bit back or round and then an arc ahead.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import copysign, inf

from stack.components import ControlState
from stack.control.path_progress import PathProgress
from stack.control.swept import SweptFootprint
from stack.drivetrain.description import RobotDescription
from stack.drivetrain.kinematics import moved
from stack.types import Pose2D, Twist, wrap_angle

AHEAD = (0.0, 0.3, -0.3, 0.8, -0.8, 1.6, -1.6, 3.0, -3.0, 5.0, -5.0, 8.0, -8.0)
BACK = (0.0, 1.0, -1.0, 3.0, -3.0)
"""Curvatures, 1/m; up to arcs much tighter than a robot is wide."""

BACK_WAYS, TURNS = (0.1, 0.25), (0.12, -0.12, 0.3, -0.3, 0.6, -0.6, 1.0, -1.0)
"""Metres back, and radians round, that may come first."""

REACH, SHORTEST = 0.3, 0.08
"""Metres of an arc ahead that are looked at, and that it must be clear for."""

MARGIN = 0.02
"""Metres of an arc, before something on it, that are not driven."""

HEADING, PROGRESS, FIRST, REVERSE = 0.25, 0.6, 0.05, 0.3
"""Metres off the path that a radian of heading error, a metre along the path not made, a motion
that comes first, and a metre of backing up are as bad as."""

GAIN = 0.03
"""Metres that a motion must make it better to be worth it."""


@dataclass(frozen=True, slots=True)
class ArcPrimitive:
    """A constant twist and where it ends.

    Attributes:
        twist: of 1 m/s, or 1 rad/s for a turn in place.
        span: seconds of that: metres, or radians.
        end: map frame.
    """

    twist: Twist
    span: float
    end: Pose2D

    @staticmethod
    def of(begin: Pose2D, twist: Twist, span: float) -> ArcPrimitive:
        """The leg that begins at a pose."""
        return ArcPrimitive(twist, span, begin.compose(moved(twist, span)))

    def left(self, pose: Pose2D) -> float:
        """What is left of it for a robot near it, metres or radians; negative beyond its end."""
        if self.twist.linear:
            return copysign(1.0, self.twist.linear) * self.end.relative_to(pose).x
        return copysign(1.0, self.twist.angular) * wrap_angle(self.end.heading - pose.heading)


class Manoeuvres:
    """Finds motions for one robot.

    Args:
        swept: its outline, which has seen what is around.
        robot: how tightly it can turn, and whether it may back up.
    """

    def __init__(self, swept: SweptFootprint, robot: RobotDescription) -> None:
        self._swept = swept
        tightest = 1.0 / robot.turning_radius if robot.turning_radius else inf
        reverses = robot.limits.reverse_speed > 0.0
        self._arcs = [curvature for curvature in AHEAD if abs(curvature) <= tightest]
        self._back = [curvature for curvature in BACK if reverses and abs(curvature) <= tightest]
        self._turns = () if robot.turning_radius else TURNS

    def ahead(self, state: ControlState, track: PathProgress) -> ArcPrimitive | None:
        """The clear arc ahead that ends nearest to where the path would have the robot."""
        legs = self._ahead(state, state.pose)
        return min(legs, key=lambda leg: _missed(leg, track), default=None)

    def around(self, state: ControlState, track: PathProgress) -> tuple[ArcPrimitive, ...]:
        """A bit back or round and then an arc ahead; none when nothing makes it better."""
        best: tuple[ArcPrimitive, ...] = ()
        least = _badness(state.pose, track) - GAIN
        for first in self._first(state):
            price = FIRST + (REVERSE * first.span if first.twist.linear else 0.0)
            for leg in self._ahead(state, first.end):
                badness = _badness(leg.end, track) + price
                if badness < least:
                    best, least = (first, leg), badness
        return best

    def is_clear(self, state: ControlState, leg: ArcPrimitive) -> bool:
        """Whether what is left of a leg can be driven."""
        left = leg.left(state.pose)
        return left <= 0.0 or self._free(state, state.pose, leg.twist, left) == inf

    def _ahead(self, state: ControlState, begin: Pose2D) -> Iterator[ArcPrimitive]:
        for curvature in self._arcs:
            twist = Twist(1.0, curvature)
            way = min(self._free(state, begin, twist, REACH + MARGIN) - MARGIN, REACH)
            if way >= SHORTEST:
                yield ArcPrimitive.of(begin, twist, way)

    def _first(self, state: ControlState) -> Iterator[ArcPrimitive]:
        for angle in self._turns:
            turn = Twist(angular=copysign(1.0, angle))
            if self._free(state, state.pose, turn, abs(angle) + 0.05) == inf:
                yield ArcPrimitive.of(state.pose, turn, abs(angle))
        for curvature in self._back:
            twist = Twist(-1.0, curvature)
            free = self._free(state, state.pose, twist, BACK_WAYS[-1] + MARGIN)
            for way in BACK_WAYS:
                if free >= way + MARGIN:
                    yield ArcPrimitive.of(state.pose, twist, way)

    def _free(self, state: ControlState, pose: Pose2D, twist: Twist, reach: float) -> float:
        free, _ = self._swept.arc(state.costs, pose, twist, reach)
        return free


def _missed(leg: ArcPrimitive, track: PathProgress) -> float:
    """How far a leg ends from where the path would have the robot by then, metres."""
    there = track.pose_ahead(leg.span)
    turn = abs(wrap_angle(leg.end.heading - there.heading))
    return leg.end.distance_to(there) + HEADING * turn - PROGRESS * leg.span


def _badness(pose: Pose2D, track: PathProgress) -> float:
    """How far a pose is from the path, and not along it, metres."""
    length, offset, heading = track.foot(pose)
    turn = abs(wrap_angle(pose.heading - heading))
    return offset + HEADING * turn - PROGRESS * (length - track.travelled)
