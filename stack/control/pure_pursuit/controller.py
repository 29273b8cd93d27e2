"""Regulated pure pursuit controller.

S. Macenski, S. Singh, F. Martín, J. Ginés, "Regulated Pure Pursuit for Robot Path Tracking",
Autonomous Robots 47, 2023; pure pursuit itself: R. C. Coulter, CMU-RI-TR-92-01, 1992.

The robot drives the arc through a lookahead point on the path: curvature 2 y / d² for a point at
distance d and lateral offset y. Speed is regulated by curvature, by the costs ahead, by
the distance to the goal and by the time to collision. Additions: the path is extended beyond the
goal for steering (see `PathSegment`), shorter lookahead distances are tried when an arc would hit
an obstacle that the path avoids, and all commands respect the robot's accelerations. A car respects
its turning radius and never turns in place; it drives with the curvature of the path itself, and
only its distance from the path is corrected as the lookahead point says, so that it does not cut
bends. An omnidirectional robot drives straight to the lookahead point and turns to the target
heading at the same time.
"""

from __future__ import annotations

from dataclasses import replace
from math import hypot, inf

import numpy as np

from stack.compilation import KernelTypes
from stack.components import Controller, ControlState, GoalTolerance, StopCriterion
from stack.control.pure_pursuit.lookahead_arc import LookaheadArc, lacking_curvature
from stack.control.pure_pursuit.manoeuvre_driver import ManoeuvreDriver, is_blocked
from stack.control.pure_pursuit.parameters import PurePursuitParameters
from stack.control.ramps import Ramp, stopping_speed
from stack.control.swept import SweptFootprint
from stack.control.turning import BRAKE_SHARE, TurnInPlace, TurnStyle, turning_speed
from stack.drivetrain.description import RobotDescription
from stack.drivetrain.kinematics import poses_along, speed_towards
from stack.geometry.path_segment import PathSegment
from stack.types import STANDSTILL, Path, Pose2D, Twist
from stack.types import wrap_angle as wrap

LOOKAHEAD_FACTORS = (1.0, 0.6, 0.35)
"""Factors on the lookahead distance, tried in turn while the arc ahead is not clear."""


class PurePursuit(Controller):
    """Regulated pure pursuit with turns in place towards the path and collision checks ahead."""

    Parameters = PurePursuitParameters
    parameters: PurePursuitParameters

    @staticmethod
    def kernels(parameters: PurePursuitParameters, robot: RobotDescription) -> KernelTypes:
        from stack.control.kernels import FREE_TIMES, SWEEP

        return (*SWEEP, *FREE_TIMES)

    def __init__(
        self, parameters: PurePursuitParameters, robot: RobotDescription, period: float
    ) -> None:
        self._limits, self._period = robot.limits, period
        self._drivetrain, self._radius = robot.drivetrain, robot.turning_radius
        self._is_round = robot.footprint.is_round
        self._swept = SweptFootprint(robot.footprint, padding=parameters.padding, exact=True)
        self._manoeuvre = ManoeuvreDriver(self._swept, robot, period)
        self._segment: PathSegment | None = None
        self._turning = False
        self._last = STANDSTILL
        self._state: ControlState | None = None
        self._tolerance = GoalTolerance()
        self.configure(parameters)

    def configure(self, parameters: PurePursuitParameters) -> None:
        self.parameters = parameters
        self._swept.keep(parameters.padding)
        self._ramp = Ramp(self._drivetrain, self._period, parameters.response_time)
        self._exact = parameters.within(self._tolerance)
        self._turns = TurnInPlace(self._swept, self._ramp, _style(self._exact))
        self._manoeuvre.configure(parameters, self._ramp, self._turns)

    def set_tolerance(self, tolerance: GoalTolerance) -> None:
        self._tolerance, self._exact = tolerance, self.parameters.within(tolerance)
        self._turns.adopt(_style(self._exact))

    def start(self, now: float) -> None:
        self._manoeuvre.resume(now)

    def pause(self, now: float) -> None:
        """Hold the drive; the robot comes to a stand."""
        self._manoeuvre.leave(now)
        self._last = STANDSTILL

    def resume(self, now: float) -> None:
        self._manoeuvre.resume(now)

    def stop(self, now: float) -> None:
        self._manoeuvre.leave(now)

    @property
    def top_speed(self) -> float:
        return self.parameters.cruise_speed

    @property
    def stop_criterion(self) -> StopCriterion:
        """At the end of the path."""
        return StopCriterion(self._exact.stop_distance, along_path=True)

    def set_segment(self, segment: PathSegment) -> None:
        self._segment, self._turning = segment, False

    def step(self, state: ControlState) -> Twist:
        segment, self._state = self._segment, state
        self._swept.see(None if state.points is None else state.pose.transform(state.points))
        if segment is None:
            return STANDSTILL
        self._manoeuvre.compare(self._last, state.twist)
        self._last = self._ramp.rebased(self._last, state.twist)
        if state.at_goal:
            chosen = self._turn(state, wrap(segment.path.goal.heading - state.pose.heading))
        elif self._drivetrain.can_move_sideways:
            chosen = self._drive_omni(segment, state)
        else:
            chosen = self._pursue(segment, state)
        self._last = chosen or STANDSTILL
        if chosen is None:
            raise self.blocked()
        return chosen

    @property
    def local_plan(self) -> Path | None:
        """The last command, driven for `time_to_collision`, map frame."""
        if self._state is None or self._segment is None:
            return None
        times = np.linspace(0.0, self.parameters.time_to_collision, 11)
        return Path(poses_along(self._state.pose, self._last, times))

    def _pursue(self, segment: PathSegment, state: ControlState) -> Twist | None:
        """Follow the path: a clear arc or a turn in place; None when neither is safe."""
        manoeuvre = self._manoeuvre.go_on(state, self._last)
        if manoeuvre is not None:
            return manoeuvre
        lookahead = self._lookahead_distance(state.twist.linear, segment.remaining)
        arc = self._arc(segment, state, segment.lookahead_point(state.pose, lookahead))
        self._turning = abs(arc.bearing) > self._turn_threshold(segment, state)
        if self._turning:
            turn = self._turn(state, arc.bearing) or self._manoeuvre.begin(
                segment, state, self._last
            )
            if turn is None and self._is_round and not is_blocked(segment, state):
                turn = self._turns.free_twist(self._last, arc.bearing)
            return turn
        wanted = self._speed(arc, segment.remaining)
        for share in LOOKAHEAD_FACTORS[1:]:
            clear = arc.free >= wanted * self.parameters.time_to_collision
            if clear or self._at_end(arc, segment):
                break
            other = self._arc(segment, state, segment.nearer_point(state.pose, share * lookahead))
            if other.free > arc.free and abs(other.bearing) < self.parameters.turn_angle:
                arc = other
        if arc.free <= self.parameters.clearance:
            return self._manoeuvre.begin(segment, state, self._last)
        creeps = self._creeps(arc, segment) and not is_blocked(segment, state)
        past = self._manoeuvre.arc_past(segment, state, self._last) if creeps else None
        return past or self._driven(arc, segment.remaining)

    def _creeps(self, arc: LookaheadArc, segment: PathSegment) -> bool:
        """Whether the robot would creep up to an obstacle on an arc that is not the last one."""
        p = self.parameters
        slow = abs(self._last.linear) <= p.min_speed + 1e-9
        if not slow or self._room_speed(arc) >= p.min_speed:
            return False
        return segment.remaining > p.min_lookahead and not self._at_end(arc, segment)

    def _room_speed(self, arc: LookaheadArc) -> float:
        """Speed at which a collision on an arc is `time_to_collision` ahead, m/s."""
        return (arc.free - self.parameters.clearance) / self.parameters.time_to_collision

    def _drive_omni(self, segment: PathSegment, state: ControlState) -> Twist | None:
        """Drive straight to a lookahead point; turn at the same time if that is clear too."""
        speed = hypot(state.twist.linear, state.twist.lateral)
        lookahead = self._lookahead_distance(speed, segment.remaining)
        best: LookaheadArc | None = None
        for share in LOOKAHEAD_FACTORS:
            point = segment.nearer_point(state.pose, share * lookahead)
            for turning in (True, False):
                arc = self._line(segment, state, point, turning=turning)
                room = self._speed(arc, segment.remaining) * self.parameters.time_to_collision
                if arc.free >= room or self._at_end(arc, segment):
                    return self._driven(arc, segment.remaining)
                if best is None or arc.free > best.free:
                    best = arc
        free = best is not None and best.free > self.parameters.clearance
        return self._driven(best, segment.remaining) if best and free else None

    def _line(
        self, segment: PathSegment, state: ControlState, point: tuple[float, float],
        *, turning: bool,
    ) -> LookaheadArc:  # fmt: skip
        """The straight motion to a point of the map frame, with its free distance and cost."""
        p, pose, goal = self.parameters, state.pose, segment.path.goal
        towards = pose.bearing_to(Pose2D(*point))
        near = segment.remaining <= p.max_lookahead
        heading = goal.heading if near or p.omni_heading == "goal" else towards
        bearing, speed = wrap(towards - pose.heading), max(self._cruise(), p.creep_speed)
        rate = turning_speed(wrap(heading - pose.heading), self._turns.style, self._ramp)
        curvature = rate / speed if turning else 0.0
        line = LookaheadArc(curvature, bearing, sideways=True)
        return self._checked(line, segment, state)

    def _at_end(self, arc: LookaheadArc, segment: PathSegment) -> bool:
        return arc.free >= segment.remaining

    def _lookahead_distance(self, speed: float, remaining: float) -> float:
        """Lookahead distance, metres: proportional to speed, near the goal at most up to it.

        A car keeps looking beyond the goal, so that it arrives with the path's heading.
        """
        p = self.parameters
        distance = min(max(speed * p.lookahead_time, p.min_lookahead), p.max_lookahead)
        if not self._drivetrain.turns_in_place:
            return distance
        return min(distance, max(remaining, 0.5 * p.min_lookahead))

    def _turn_threshold(self, segment: PathSegment, state: ControlState) -> float:
        """Angle to the path above which the robot turns in place, radians.

        Larger while it drives, so that it takes corners of up to 110 degrees without a stop.
        Smaller at the start of a short path, which leaves no room for an arc. A started turn
        continues until the path is nearly ahead.
        """
        p = self.parameters
        if not self._drivetrain.turns_in_place:
            return inf
        if self._turning:
            return min(0.1, p.turn_angle)
        if abs(state.twist.linear) >= p.min_speed:
            return 1.5 * p.turn_angle
        if segment.travelled < 0.05:
            return p.turn_angle * min(1.0, max(0.15, segment.remaining))
        return p.turn_angle

    def _arc(
        self, segment: PathSegment, state: ControlState, point: tuple[float, float]
    ) -> LookaheadArc:
        """The arc through a point of the map frame, with its free distance and cost."""
        arc = LookaheadArc.through(state.pose, point)
        curvature = arc.curvature
        if not self._drivetrain.turns_in_place:
            ahead = abs(state.twist.linear) * self.parameters.response_time
            curvature += lacking_curvature(segment, point, ahead)
        if self._radius:
            curvature = min(max(curvature, -1.0 / self._radius), 1.0 / self._radius)
        return self._checked(replace(arc, curvature=curvature), segment, state)

    def _checked(
        self, arc: LookaheadArc, segment: PathSegment, state: ControlState
    ) -> LookaheadArc:
        """Return the arc with its free distance and cost."""
        p, speed = self.parameters, self._cruise()
        brake = BRAKE_SHARE * self._limits.linear_deceleration
        reach = max(speed * p.time_to_collision, speed * p.response_time + speed**2 / (2 * brake))
        reach = min(reach + p.clearance, segment.remaining + p.stop_distance)
        free, cost = self._swept.arc(state.costs, state.pose, arc.twist(1.0), reach)
        return replace(arc, free=free, cost=cost)

    def _cruise(self) -> float:
        return min(self.parameters.cruise_speed, self._limits.linear_speed)

    def _speed(self, arc: LookaheadArc, remaining: float) -> float:
        """Cruise speed regulated by curvature, cost and remaining length, without collisions."""
        p = self.parameters
        speed = self._cruise()
        if abs(arc.curvature) * p.min_radius > 1.0 and not arc.sideways:
            speed /= abs(arc.curvature) * p.min_radius
        speed *= 1.0 - p.cost_slowdown * arc.cost / 252.0
        speed = max(speed, min(p.min_speed, self._cruise()))
        if arc.sideways:
            speed = min(speed, speed_towards(arc.bearing, self._limits))
        elif arc.curvature:
            speed = min(speed, self._limits.angular_speed / abs(arc.curvature))
        stopping = stopping_speed(
            remaining - 0.5 * self._exact.stop_distance,
            BRAKE_SHARE * self._limits.linear_deceleration,
            p.response_time + self._period,
        )
        return min(speed, max(stopping, self._exact.final_speed(p.creep_speed, self._period)))

    def _driven(self, arc: LookaheadArc, remaining: float) -> Twist:
        p, last = self.parameters, self._last
        speed = self._speed(arc, remaining)
        speed = max(min(speed, self._room_speed(arc)), min(p.creep_speed, speed))
        if arc.sideways:
            wanted, rate = arc.twist(speed), arc.curvature * max(self._cruise(), p.creep_speed)
            return self._ramp.towards(last, replace(wanted, angular=rate))
        linear = self._ramp.forward(last.linear, speed)
        driven = Twist(linear, self._ramp.turn(last.angular, linear * arc.curvature))
        return self._drivetrain.feasible(driven)

    def _turn(self, state: ControlState, angle: float) -> Twist | None:
        """Turn in place; a car can only stop."""
        if not self._drivetrain.turns_in_place:
            return self._ramp.stopped(self._last) if state.at_goal else None
        return self._turns.twist(state, self._last, angle)


def _style(p: PurePursuitParameters) -> TurnStyle:
    return TurnStyle(p.turn_speed, p.turn_precision)
