"""The last centimetres to a goal whose tolerance is finer than a controller stops by itself."""

from __future__ import annotations

from math import asin, hypot, pi

from stack.components import ControlState
from stack.control.ramps import Ramp, stopping_speed
from stack.control.swept import SweptFootprint
from stack.control.turning import TurnInPlace
from stack.types import Pose2D, Twist, wrap_angle

APPROACH_DISTANCE = 0.1
"""Metres to the goal within which the robot approaches it straight."""

TURN_ENDS_AT_SHARE = 0.3
"""Share of the angle that starts a turn at which it ends."""


class FinalApproach:
    """Drives straight to a goal position close by: turns in place first, or backs up to it.

    Laws that steer along a path oscillate where the distance is of the order of one step.

    Args:
        swept: outline of the robot.
        ramp: limits of change between two commands.
        turn: turns in place.
        reverses: whether the robot can drive backward.
    """

    def __init__(
        self, swept: SweptFootprint, ramp: Ramp, turn: TurnInPlace, *, reverses: bool
    ) -> None:
        self._swept, self._ramp, self._turn, self._reverses = swept, ramp, turn, reverses
        self._turning = False

    def twist(
        self, state: ControlState, last: Twist, goal: Pose2D, within: float, slowest: float
    ) -> Twist | None:
        """Return the next command; None if the goal is farther away or the motion not clear.

        Args:
            state: of the robot.
            last: the previous command.
            goal: map frame.
            within: metres to the goal that are enough.
            slowest: lowest speed, m/s.
        """
        away = state.pose.distance_to(goal)
        if away > APPROACH_DISTANCE:
            return None
        bearing = wrap_angle(state.pose.bearing_to(goal) - state.pose.heading)
        way = -1.0 if self._reverses and abs(bearing) > 0.5 * pi else 1.0
        error = wrap_angle(bearing + pi) if way < 0.0 else bearing
        limit = asin(min(1.0, within / away)) if away > 0.0 else pi
        ends = max(limit * TURN_ENDS_AT_SHARE, self._turn.style.precision)
        self._turning = abs(error) > (ends if self._turning else max(limit, ends))
        moves = hypot(last.linear, last.lateral) > slowest
        if self._turning and moves:
            return self._ramp.stopped(last)
        if self._turning:
            return self._turn.twist(state, last, error)
        free, _ = self._swept.arc(state.costs, state.pose, Twist(way), away)
        if free < away:
            return None
        brake = 0.5 * self._ramp.limits.linear_deceleration
        delay = self._ramp.response_time + self._ramp.period
        speed = max(stopping_speed(away - 0.5 * within, brake, delay), slowest)
        return self._ramp.towards(last, Twist(way * speed))
