"""Turns in place at the start of a path and to the goal's heading at its end.

Shared by the controllers that themselves only drive along the path.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot, radians

from stack.components import ControlState, GoalTolerance, StopCriterion
from stack.control.final_approach import APPROACH_DISTANCE, FinalApproach
from stack.control.parameters import FollowingParameters
from stack.control.ramps import Ramp
from stack.control.swept import SweptFootprint
from stack.control.turning import SLOWEST_TURN, RotationShim, TurnInPlace, TurnStyle
from stack.drivetrain.description import RobotDescription
from stack.geometry.path_segment import PathSegment
from stack.parameters import parameter
from stack.types import STANDSTILL, Pose2D, Twist, wrap_angle

JUST_AHEAD = 0.2
"""Distance in metres of the path point that a blocked robot turns towards."""

CREEP_SPEED = 0.05
"""Lowest speed in m/s of the straight approach, and less to stop more exactly."""

HELD_AFTER = 0.5
"""Seconds after which a robot that does not follow its commands counts as held."""

TURNS_SUSPENDED_FOR = 2.0
"""Seconds of driving without a turn in place after one was held."""

ALIGNED_ANGLE = 0.1
"""Angle in radians to that point below which the robot does not turn."""


POSE_SHARE = 0.3
"""Deviation of the estimated position, divided by the noise of a lidar's ranges.

Measured: 3 mm in simulation, with 1 cm of noise.
"""

CAR_TOLERANCE = GoalTolerance(0.03, radians(3.0))
"""What a car leaves at the end of a planned path: it cannot correct an error beside the path there.

An estimate: drives in the tests of cars end within it.
"""


@dataclass(frozen=True)
class GoalAlignmentParameters(FollowingParameters):
    """Parameters of `GoalAlignment`, inherited by each controller that uses it."""

    rotate_to_heading: bool = parameter(
        True, public=True, help="turn in place towards the path before driving along it"
    )
    rotate_angle: float = parameter(
        1.0, "rad", above=0.0, help="angle to the path above which the robot turns in place"
    )
    rotate_lookahead: float = parameter(
        0.4, "m", above=0.0, at_most=5.0, help="distance of the path point to turn towards"
    )
    rotate_until: float = parameter(
        0.3, at_least=0.0, at_most=1.0, help="share of rotate_angle at which that turn ends"
    )
    rotate_speed: float = parameter(
        1.4, "rad/s", above=0.0, robot_limit="angular_speed", help="top speed of turns in place"
    )
    turn_speed: float = parameter(
        1.9, "rad/s", above=0.0, robot_limit="angular_speed", public=True, help="top turning speed"
    )


class GoalAlignment:
    """Commands the turns at both ends of a path.

    Attributes:
        parameters: those given, or stricter ones within the tolerance at the goal.
        segment: that the robot drives; None before the first path.
        ramp: limits of change between two commands.
        last: the last command.
    """

    def __init__(
        self, parameters: GoalAlignmentParameters, robot: RobotDescription, swept: SweptFootprint,
        period: float,
    ) -> None:  # fmt: skip
        p = self.parameters = parameters
        self.ramp = Ramp(robot.drivetrain, period, p.response_time)
        self._turn = TurnInPlace(swept, self.ramp, _style(p))
        reverses = robot.limits.reverse_speed > 0.0
        self._approach = FinalApproach(swept, self.ramp, self._turn, reverses=reverses)
        self._is_exact = False
        self._drivetrain = robot.drivetrain
        self._shim = RotationShim(p.rotate_lookahead, p.rotate_until)
        self.segment: PathSegment | None = None
        self.last = STANDSTILL
        self._held_steps, self._suspended, self._period = 0, 0.0, period

    @property
    def stop_criterion(self) -> StopCriterion:
        """At the goal; for a car, at the end of its path.

        A car with a lateral offset from the goal would have to drive a circle to reduce it.
        """
        is_car = not self._drivetrain.turns_in_place
        return StopCriterion(self.parameters.stop_distance, along_path=is_car)

    def set_tolerance(self, parameters: GoalAlignmentParameters, tolerance: GoalTolerance) -> None:
        """Stop within a tolerance of the goal, if the parameters do not stop nearer to it."""
        p = self.parameters = parameters.within(tolerance)
        self._turn.adopt(_style(p))
        self._is_exact = p.stop_distance < parameters.stop_distance

    def set_segment(self, segment: PathSegment) -> None:
        """Set the segment to drive along, map frame."""
        p = self.parameters
        self.segment, self._shim = segment, RotationShim(p.rotate_lookahead, p.rotate_until)

    def commanded(self, twist: Twist) -> None:
        """Note the command of this step."""
        self.last = twist

    def begin(self, state: ControlState) -> None:
        """Compare the last command with the measured velocity."""
        self._note_hold(state.twist)
        self.last = self.ramp.rebased(self.last, state.twist)

    @property
    def held(self) -> bool:
        """Whether the robot has not followed its commands for a while.

        The safety stage then sees an obstacle that the costmap does not contain.
        """
        return self._held_steps * self._period >= HELD_AFTER

    def _note_hold(self, measured: Twist) -> None:
        wanted, driven = _rim_speed(self.last), _rim_speed(measured)
        if wanted > 0.05 and driven < 0.25 * wanted:
            self._held_steps += 1
            self._suspended = TURNS_SUSPENDED_FOR if self.held else self._suspended
        else:
            self._held_steps = max(0, self._held_steps - 1)
            self._suspended = max(0.0, self._suspended - self._period)

    def distance_left(self, state: ControlState) -> float:
        """Braking distance in metres: to the goal; for a car, to the end of its path."""
        if self.segment is None:
            return 0.0
        if not self._drivetrain.turns_in_place:
            return self.segment.remaining
        return max(self.segment.remaining, state.pose.distance_to(self.segment.path.goal))

    def finish(self, state: ControlState) -> Twist | None:
        """At the goal: stop and turn to its heading; None while the turn is blocked.

        A car only stops and keeps its heading.
        """
        if not self._drivetrain.turns_in_place:
            return self.ramp.stopped(self.last)
        return self._turn.twist(state, self.last, self._heading_error(state))

    def approached(self, state: ControlState) -> Twist | None:
        """The straight motion to a goal close by that has to be met more exactly than usual."""
        segment, p = self.segment, self.parameters
        if not (self._is_exact and segment is not None and self._drivetrain.turns_in_place):
            return None
        if not segment.ends_within(APPROACH_DISTANCE):
            return None
        slowest = p.final_speed(CREEP_SPEED, self._period)
        return self._approach.twist(state, self.last, segment.path.goal, p.stop_distance, slowest)

    def turned(self, state: ControlState) -> Twist | None:
        """A turn in place towards the path; None when it is not needed or not possible."""
        p = self.parameters
        if self.segment is None or self._suspended or not self._turns_first(self.segment):
            return None
        angle = self._shim.angle(self.segment, state, p.rotate_angle, p.stop_distance)
        return None if angle is None else self._turn.twist(state, self.last, angle)

    def _turns_first(self, segment: PathSegment) -> bool:
        """Whether to turn first: not a car; not an omnidirectional robot close to the goal."""
        p = self.parameters
        if self._drivetrain.can_move_sideways and segment.remaining <= p.rotate_lookahead:
            return False
        return p.rotate_to_heading and self._drivetrain.turns_in_place

    def realigned(self, state: ControlState) -> Twist | None:
        """A turn in place towards the path just ahead, used when no other motion is clear."""
        if self.segment is None or not self._drivetrain.turns_in_place:
            return None
        x, y = self.segment.nearer_point(state.pose, JUST_AHEAD)
        angle = wrap_angle(state.pose.bearing_to(Pose2D(x, y)) - state.pose.heading)
        return None if abs(angle) <= ALIGNED_ANGLE else self._turn.twist(state, self.last, angle)

    def ramped(self, twist: Twist) -> Twist:
        """Return the twist that is reachable in one control period."""
        return self.ramp.towards(self.last, twist)

    def _heading_error(self, state: ControlState) -> float:
        if self.segment is None:
            return 0.0
        return wrap_angle(self.segment.path.goal.heading - state.pose.heading)


def _style(p: GoalAlignmentParameters) -> TurnStyle:
    return TurnStyle(p.rotate_speed, p.turn_precision)


def _rim_speed(twist: Twist) -> float:
    """Highest speed of a point 0.2 m from the robot's centre, m/s."""
    return hypot(twist.linear, twist.lateral) + 0.2 * abs(twist.angular)


def finest_tolerance(robot: RobotDescription, period: float) -> GoalTolerance:
    """Return the finest tolerances that a robot can be expected to meet.

    It stops somewhere in one control period at its lowest speed, and knows its position only as
    exactly as it is estimated.

    Args:
        robot: its kind of drive and its lidars.
        period: seconds between two commands.
    """
    noise = min((lidar.noise for lidar in robot.all_lidars.values()), default=0.0)
    position, heading = CREEP_SPEED * period + POSE_SHARE * noise, SLOWEST_TURN * period
    if robot.drivetrain.turns_in_place:
        return GoalTolerance(position, heading)
    return GoalTolerance(max(position, CAR_TOLERANCE.position), max(heading, CAR_TOLERANCE.heading))
