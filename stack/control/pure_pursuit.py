"""Regulated pure pursuit.

S. Macenski, S. Singh, F. Martín, J. Ginés, "Regulated Pure Pursuit for Robot Path Tracking",
Autonomous Robots 47, 2023; pure pursuit itself: R. C. Coulter, CMU-RI-TR-92-01, 1992.

The robot drives the arc through a lookahead point on the path: curvature 2 y / d² for a point at
distance d and lateral offset y. Speed is regulated by curvature, by the cost of what lies ahead,
by the distance left to the goal and by the time to a collision. Added here: for steering, the path
is extended beyond the goal (see `PathProgress`), shorter lookaheads are tried when an arc would
touch something that the path itself avoids, and all speeds respect the robot's accelerations. A
car respects its turning radius and never turns in place; an omnidirectional robot drives straight
to the lookahead point and turns to the target heading on the way.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import cos, hypot, inf, sin

import numpy as np

from stack.components import ControlState
from stack.control.manoeuvre import ArcPrimitive, Manoeuvres
from stack.control.parameters import FollowingParameters
from stack.control.path_progress import PathProgress
from stack.control.patience import Patience
from stack.control.ramps import Ramp, stopping_speed
from stack.control.swept import SweptFootprint
from stack.control.turning import TurnInPlace, TurnStyle, turning_speed
from stack.costmap.route_costs import blocked_at
from stack.drivetrain.description import DriveKind, RobotDescription
from stack.drivetrain.kinematics import moved, speed_towards, within_turning_radius
from stack.parameters import parameter
from stack.types import LETHAL_COST, STANDSTILL, Path, Pose2D, Twist
from stack.types import wrap_angle as wrap

SHORTER = (1.0, 0.6, 0.35)
"""Shares of the lookahead distance tried in turn while the arc ahead is not clear."""

LEG_DONE = 0.02
"""Metres or radians left of a motion that count as none."""

CLEAR_AHEAD = 0.8
"""Metres of path that must be clear for it to be worth while to find a way onto it."""

FORGOTTEN = 0.5
"""Seconds without a command after which a motion begun is not gone on with."""

NOT_ARRIVED_BEYOND = 0.06
"""Metres to the goal within which a new path to it does not send the robot off again."""


@dataclass(frozen=True)
class PurePursuitParameters(FollowingParameters):
    """Settings of `PurePursuit`."""

    min_speed: float = parameter(
        0.15, "m/s", above=0.0, help="curvature and cost slow down no further than this"
    )
    creep_speed: float = parameter(
        0.05, "m/s", above=0.0, help="slowest speed, near the goal or something in the way"
    )
    lookahead_time: float = parameter(1.0, "s", above=0.0, help="lookahead distance over speed")
    min_lookahead: float = parameter(0.3, "m", above=0.0, help="shortest lookahead distance")
    max_lookahead: float = parameter(0.9, "m", above=0.0, help="longest lookahead distance")
    min_radius: float = parameter(
        0.9, "m", at_least=0.0, help="arcs tighter than this are driven slower in proportion"
    )
    cost_slowdown: float = parameter(
        0.5, at_least=0.0, at_most=1.0, help="share of speed lost where an obstacle is nearest"
    )
    turn_angle: float = parameter(
        0.785, "rad", above=0.0, help="turn in place when the path lies farther off than this"
    )
    turn_speed: float = parameter(1.4, "rad/s", above=0.0, help="top speed of turns in place")
    goal_position: float = parameter(
        0.01, "m", above=0.0, help="way left at which it stops and turns to the goal's heading"
    )
    time_to_collision: float = parameter(
        1.0, "s", above=0.0, help="slower when something would be touched sooner"
    )
    clearance: float = parameter(
        0.06, "m", at_least=0.0, help="what stays free before something on the arc"
    )
    omni_heading: str = parameter(
        "path", one_of=("path", "goal"),
        help="omnidirectional robots only: face along the path, or as at the goal, all the way",
    )  # fmt: skip
    padding: float = parameter(
        0.02, "m", at_least=0.0, at_most=0.5, help="stays free round the footprint"
    )


@dataclass(frozen=True, slots=True)
class _Arc:
    """A way to drive.

    Attributes:
        curvature: turning per metre, 1/m.
        bearing: of the point aimed at, base frame, radians.
        free: metres that are clear.
        cost: worst under it.
        sideways: whether it leads straight to the point, not round with the heading.
    """

    curvature: float
    bearing: float
    free: float
    cost: int
    sideways: bool = False

    def twist(self, speed: float) -> Twist:
        """Driven at a speed in m/s."""
        if not self.sideways:
            return Twist(speed, speed * self.curvature)
        c, s = cos(self.bearing), sin(self.bearing)
        return Twist(speed * c, speed * self.curvature, speed * s)


class PurePursuit:
    """Regulated pure pursuit with rotation towards the path and collision look-ahead."""

    Parameters = PurePursuitParameters

    def __init__(
        self, parameters: PurePursuitParameters, robot: RobotDescription, period: float
    ) -> None:
        self.parameters, self._limits, self._period = parameters, robot.limits, period
        self._drive, self._radius = robot.drive, robot.turning_radius
        self._swept = SweptFootprint(robot.footprint, padding=parameters.padding, exact=True)
        self._manoeuvres = Manoeuvres(self._swept, robot)
        self._legs: tuple[ArcPrimitive, ...] = ()
        self._patience = Patience()
        self._track: PathProgress | None = None
        self._arrived = self._turning = False
        self._last = STANDSTILL
        self._state: ControlState | None = None

    def configure(self, parameters: PurePursuitParameters) -> None:
        """Put other parameters in force."""
        self.parameters, self._swept.padding = parameters, parameters.padding

    def set_path(self, path: Path) -> None:
        """A new path to follow, map frame."""
        self._track = PathProgress(path, steered=self._drive is DriveKind.ACKERMANN)
        self._arrived = self._turning = False

    def command(self, state: ControlState) -> Twist:
        """The velocity to drive now.

        Raises:
            NavigationError: COLLISION_AHEAD when nothing safe could be commanded for `patience`.
        """
        if self._state is not None and state.time - self._state.time > FORGOTTEN:
            self._legs = ()
        track, self._state = self._track, state
        self._swept.seen = None if state.points is None else state.pose.transform(state.points)
        if track is None:
            return STANDSTILL
        fresh = track.travelled == 0.0
        track.advance(state.pose)
        self._last = self._ramp.rebased(self._last, state.twist)
        if self._has_arrived(track, state.pose, fresh):
            chosen = self._turn(state, wrap(track.path.goal.heading - state.pose.heading))
        elif self._drive is DriveKind.OMNI:
            chosen = self._glide(track, state)
        else:
            chosen = self._pursue(track, state)
        self._last = STANDSTILL
        self._last = self._patience.bear(chosen, state.time, self.parameters.patience)
        return self._last

    @property
    def local_plan(self) -> Path | None:
        """The arc commanded last, driven for the time it looks ahead, map frame."""
        if self._state is None or self._track is None:
            return None
        times = np.linspace(0.0, self.parameters.time_to_collision, 11)
        poses = [self._state.pose.compose(moved(self._last, time)) for time in times]
        return Path(np.array([(pose.x, pose.y, pose.heading) for pose in poses]))

    def _has_arrived(self, track: PathProgress, pose: Pose2D, fresh: bool) -> bool:
        """Whether only the final heading is left; once so, it stays so for this path."""
        short = track.length <= 2.0 * NOT_ARRIVED_BEYOND
        if fresh and short and pose.distance_to(track.path.goal) <= NOT_ARRIVED_BEYOND:
            self._arrived = True
        self._arrived = self._arrived or track.remaining <= self.parameters.goal_position
        return self._arrived

    def _pursue(self, track: PathProgress, state: ControlState) -> Twist | None:
        """Along the path: the first clear arc, a turn in place, or None when neither is safe."""
        under_way = self._manoeuvred(state)
        if under_way is not None:
            return under_way
        lookahead = self._lookahead_distance(state.twist.linear, track.remaining)
        arc = self._arc(track, state, track.lookahead_point(state.pose, lookahead))
        if abs(arc.bearing) > self._turn_threshold(track, state):
            self._turning = True
            return self._turn(state, arc.bearing)
        self._turning = False
        wanted = self._speed(arc, track.remaining)
        for share in SHORTER[1:]:
            if arc.free >= wanted * self.parameters.time_to_collision or self._at_end(arc, track):
                break
            other = self._arc(track, state, track.nearer_point(state.pose, share * lookahead))
            if other.free > arc.free and abs(other.bearing) < self.parameters.turn_angle:
                arc = other
        if arc.free > self.parameters.clearance:
            return self._driven(arc, track.remaining)
        return self._squeeze(track, state)

    def _manoeuvred(self, state: ControlState) -> Twist | None:
        """The next command of the manoeuvre under way; None when there is none."""
        while self._legs and self._legs[0].left(state.pose) <= LEG_DONE:
            self._legs = self._legs[1:]
        if self._legs and not self._manoeuvres.is_clear(state, self._legs[0]):
            self._legs = ()
        return self._leg_twist(state, self._legs[0]) if self._legs else None

    def _squeeze(self, track: PathProgress, state: ControlState) -> Twist | None:
        """Where no arc to the path is clear but the path is: a motion that leads onto it."""
        if self._is_blocked(track, state):
            return None
        ahead = self._manoeuvres.ahead(state, track)
        if ahead is not None:
            return self._leg_twist(state, ahead)
        self._legs = self._manoeuvres.around(state, track)
        return self._manoeuvred(state)

    def _leg_twist(self, state: ControlState, leg: ArcPrimitive) -> Twist | None:
        p = self.parameters
        if not leg.twist.linear:
            return self._turn(state, wrap(leg.end.heading - state.pose.heading))
        speed = max(p.creep_speed, min(p.min_speed, leg.left(state.pose) / p.time_to_collision))
        if leg.twist.angular:
            speed = min(speed, 0.5 * self._limits.angular_speed / abs(leg.twist.angular))
        speed *= leg.twist.linear
        linear = self._ramp.forward(self._last.linear, speed)
        return Twist(linear, self._ramp.turn(self._last.angular, abs(linear) * leg.twist.angular))

    def _is_blocked(self, track: PathProgress, state: ControlState) -> bool:
        """Whether something stands on the path itself, and not only near it.

        What is too near by this costmap's cells need not be by what the scan says.
        """
        points = track.ahead(CLEAR_AHEAD)
        return blocked_at(state.costs, points, state.pose, 0.0, LETHAL_COST) is not None

    def _glide(self, track: PathProgress, state: ControlState) -> Twist | None:
        """Straight to a lookahead point with a clear way, turning if that is clear as well."""
        speed = hypot(state.twist.linear, state.twist.lateral)
        lookahead = self._lookahead_distance(speed, track.remaining)
        best: _Arc | None = None
        for share in SHORTER:
            point = track.nearer_point(state.pose, share * lookahead)
            for turning in (True, False):
                arc = self._line(track, state, point, turning=turning)
                room = self._speed(arc, track.remaining) * self.parameters.time_to_collision
                if arc.free >= room or self._at_end(arc, track):
                    return self._driven(arc, track.remaining)
                if best is None or arc.free > best.free:
                    best = arc
        free = best is not None and best.free > self.parameters.clearance
        return self._driven(best, track.remaining) if best and free else None

    def _line(
        self, track: PathProgress, state: ControlState, point: tuple[float, float], *, turning: bool
    ) -> _Arc:
        """The straight way to a point of the map frame, and what lies on it."""
        p, pose, goal = self.parameters, state.pose, track.path.goal
        towards = pose.bearing_to(Pose2D(*point))
        near = track.remaining <= p.max_lookahead
        heading = goal.heading if near or p.omni_heading == "goal" else towards
        bearing, speed = wrap(towards - pose.heading), max(self._cruise(), p.creep_speed)
        rate = turning_speed(wrap(heading - pose.heading), self._style, self._ramp)
        curvature = rate / speed if turning else 0.0
        line = _Arc(curvature, bearing, 0.0, 0, sideways=True)
        return self._looked_at(line, track, state)

    def _at_end(self, arc: _Arc, track: PathProgress) -> bool:
        return arc.free >= track.remaining

    def _lookahead_distance(self, speed: float, remaining: float) -> float:
        """Longer when faster; on the last bit as far as the goal, so that it is hit.

        A car looks on beyond the goal: so it arrives with the path's heading.
        """
        p = self.parameters
        usual = min(max(speed * p.lookahead_time, p.min_lookahead), p.max_lookahead)
        if self._drive is DriveKind.ACKERMANN:
            return usual
        return min(usual, max(remaining, 0.5 * p.min_lookahead))

    def _turn_threshold(self, track: PathProgress, state: ControlState) -> float:
        """How far off the path may lie before the robot turns in place, radians.

        More while it drives, so that it swings through corners up to 110 degrees without a stop.
        Less for a short path begun from a stand, which leaves no room to swing in. A turn begun
        goes on until the path lies nearly ahead.
        """
        p = self.parameters
        if self._drive is DriveKind.ACKERMANN:
            return inf
        if self._turning:
            return min(0.1, p.turn_angle)
        if abs(state.twist.linear) >= p.min_speed:
            return 1.5 * p.turn_angle
        if track.travelled < 0.05:
            return p.turn_angle * min(1.0, max(0.15, track.remaining))
        return p.turn_angle

    def _arc(self, track: PathProgress, state: ControlState, point: tuple[float, float]) -> _Arc:
        """The arc through a point of the map frame, and what lies on it."""
        (x, y), pose = point, state.pose
        dx, dy = x - pose.x, y - pose.y
        c, s = cos(pose.heading), sin(pose.heading)
        forward, left = c * dx + s * dy, c * dy - s * dx
        square = max(1e-6, dx * dx + dy * dy)
        bearing = float(np.arctan2(left, forward))
        curvature = 2.0 * left / square
        if self._radius:
            curvature = min(max(curvature, -1.0 / self._radius), 1.0 / self._radius)
        return self._looked_at(_Arc(curvature, bearing, 0.0, 0), track, state)

    def _looked_at(self, arc: _Arc, track: PathProgress, state: ControlState) -> _Arc:
        """The arc with what lies on it."""
        p, speed = self.parameters, self._cruise()
        brake = p.brake_share * self._limits.linear_deceleration
        reach = max(speed * p.time_to_collision, speed * p.response_time + speed**2 / (2 * brake))
        reach = min(reach + p.clearance, track.remaining + p.goal_position)
        free, cost = self._swept.arc(state.costs, state.pose, arc.twist(1.0), reach)
        return replace(arc, free=free, cost=cost)

    def _cruise(self) -> float:
        return min(self.parameters.cruise_speed, self._limits.linear_speed)

    def _speed(self, arc: _Arc, remaining: float) -> float:
        """Cruise speed regulated by curvature, cost and the way left, before collisions."""
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
            remaining - 0.5 * p.goal_position,
            p.brake_share * self._limits.linear_deceleration,
            p.response_time + self._period,
        )
        return min(speed, max(stopping, p.creep_speed))

    def _driven(self, arc: _Arc, remaining: float) -> Twist:
        p, last = self.parameters, self._last
        speed = self._speed(arc, remaining)
        room = (arc.free - p.clearance) / p.time_to_collision
        speed = max(min(speed, room), min(p.creep_speed, speed))
        if arc.sideways:
            wanted, rate = arc.twist(speed), arc.curvature * max(self._cruise(), p.creep_speed)
            return self._ramp.towards(last, replace(wanted, angular=rate))
        linear = self._ramp.forward(last.linear, speed)
        driven = Twist(linear, self._ramp.turn(last.angular, linear * arc.curvature))
        return within_turning_radius(driven, self._radius)

    def _turn(self, state: ControlState, angle: float) -> Twist | None:
        """In place; a car can only stop."""
        if self._drive is DriveKind.ACKERMANN:
            return self._ramp.stopped(self._last) if self._arrived else None
        return TurnInPlace(self._swept, self._ramp, self._style).twist(state, self._last, angle)

    @property
    def _style(self) -> TurnStyle:
        p = self.parameters
        return TurnStyle(p.turn_speed, p.brake_share, p.goal_heading)

    @property
    def _ramp(self) -> Ramp:
        return Ramp(self._limits, self._period, self.parameters.response_time, self._radius)
