"""Drives the short motions that lead back onto a path where no arc to it is clear."""

from __future__ import annotations

from stack.components import ControlState
from stack.control.pure_pursuit.manoeuvres import ArcPrimitive, HoldDetector, Manoeuvres
from stack.control.pure_pursuit.parameters import PurePursuitParameters
from stack.control.ramps import Ramp, stopping_speed
from stack.control.swept import SweptFootprint
from stack.control.turning import BRAKE_SHARE, TurnInPlace
from stack.costmap.route_costs import blocked_at
from stack.drivetrain.description import RobotDescription
from stack.geometry.path_segment import PathSegment
from stack.types import LETHAL_COST, Twist

PRIMITIVE_DONE = 0.02
"""Remaining metres or radians at which a motion is complete."""

CLEAR_AHEAD = 0.8
"""Metres of path ahead that must be clear before a manoeuvre onto it is searched."""

DROPPED_AFTER = 0.5
"""Seconds of interruption after which a started manoeuvre is dropped."""


def is_blocked(segment: PathSegment, state: ControlState) -> bool:
    """Whether an obstacle is on the path itself, and not only near it.

    The cells of the costmap are coarser than the scan: a near obstacle may still leave room.

    Args:
        segment: that is driven, map frame.
        state: of this step.
    """
    points = segment.ahead(CLEAR_AHEAD)
    return blocked_at(state.costs, points, state.pose, 0.0, LETHAL_COST) is not None


class ManoeuvreDriver:
    """Searches for motions onto a path, and drives them one after the other.

    Args:
        swept: the robot's outline, against the newest scan.
        robot: limits and kind of drive.
        period: of control, seconds.
    """

    def __init__(self, swept: SweptFootprint, robot: RobotDescription, period: float) -> None:
        self._limits, self._period = robot.limits, period
        self._manoeuvres = Manoeuvres(swept, robot)
        self._hold = HoldDetector(period)
        self._primitives: tuple[ArcPrimitive, ...] = ()
        self._left_at: float | None = None

    def configure(self, parameters: PurePursuitParameters, ramp: Ramp, turns: TurnInPlace) -> None:
        """Apply new parameters."""
        self._parameters, self._ramp, self._turns = parameters, ramp, turns

    def leave(self, now: float) -> None:
        """Note that the drive is interrupted."""
        self._left_at = now if self._left_at is None else self._left_at

    def resume(self, now: float) -> None:
        """Drop a manoeuvre that was interrupted for too long."""
        if self._left_at is None or now - self._left_at > DROPPED_AFTER:
            self._primitives = ()
        self._left_at = None

    def compare(self, last: Twist, measured: Twist) -> None:
        """Compare the measured velocity with the last command: safety may hold the robot."""
        self._hold.update(last, measured)

    def go_on(self, state: ControlState, last: Twist) -> Twist | None:
        """Return the next command of the manoeuvre under way; None when there is none.

        Args:
            state: of this step.
            last: the last command of the controller, base frame.
        """
        while self._primitives:
            room = self._manoeuvres.room(state, self._primitives[0])
            if room > PRIMITIVE_DONE and not self._hold.is_held:
                return self._twist(state, last, self._primitives[0], room)
            self._primitives = self._primitives[1:]
            self._hold.reset()
        return None

    def begin(self, segment: PathSegment, state: ControlState, last: Twist) -> Twist | None:
        """Return the first command of a way onto the path; None if the path is blocked, or none."""
        if is_blocked(segment, state):
            return None
        past = self.arc_past(segment, state, last)
        if past is not None:
            return past
        self._primitives = self._manoeuvres.around(state, segment)
        self._hold.reset()
        return self.go_on(state, last)

    def arc_past(self, segment: PathSegment, state: ControlState, last: Twist) -> Twist | None:
        """Another arc ahead that leads back to the path, unless something holds the robot."""
        ahead = self._manoeuvres.ahead(state, segment)
        if ahead is None or self._hold.is_held:
            return None
        return self._twist(state, last, ahead, ahead.span)

    def _twist(
        self, state: ControlState, last: Twist, primitive: ArcPrimitive, room: float
    ) -> Twist | None:
        """Drive a motion as far as there is room, metres or radians."""
        p, limits = self._parameters, self._limits
        if not primitive.twist.linear:
            return self._turns.twist(state, last, primitive.twist.angular * room)
        brake = BRAKE_SHARE * limits.linear_deceleration
        stopping = stopping_speed(room - PRIMITIVE_DONE, brake, p.response_time + self._period)
        top = min(p.min_speed, p.cruise_speed, limits.linear_speed)
        if primitive.twist.linear < 0.0:
            top = min(top, limits.reverse_speed)
        speed = max(min(p.creep_speed, top), min(top, stopping))
        if primitive.twist.angular:
            speed = min(speed, 0.5 * limits.angular_speed / abs(primitive.twist.angular))
        speed *= primitive.twist.linear
        linear = self._ramp.forward(last.linear, speed)
        turn = abs(linear) * primitive.twist.angular
        return Twist(linear, self._ramp.turn(last.angular, turn))
