"""Both ends of a path: turning towards it first, and to the goal's heading at last.

Shared by the controllers that only know how to drive along it.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot

from stack.components import ControlState
from stack.control.arrival import Arrival
from stack.control.parameters import FollowingParameters
from stack.control.path_progress import PathProgress
from stack.control.patience import Patience
from stack.control.ramps import Ramp
from stack.control.rotation_shim import LOOKAHEAD, RotationShim
from stack.control.swept import SweptFootprint
from stack.control.turning import TurnInPlace, TurnStyle
from stack.drivetrain.description import DriveKind, RobotDescription
from stack.parameters import parameter
from stack.types import STANDSTILL, Path, Pose2D, Twist, wrap_angle

JUST_AHEAD = 0.2
"""Metres ahead on the path of the point that a robot without a clear way turns to."""

HELD = 0.5
"""Seconds after which a robot that does not do what it is told counts as held up."""

SUSPENDED = 2.0
"""Seconds of driving for which no turn in place is begun after one was held up."""

ALIGNED = 0.1
"""Radians off that point with which it is content."""


@dataclass(frozen=True)
class EndsParameters(FollowingParameters):
    """Settings of `GoalAlignment`, part of the parameters of each controller that uses it."""

    rotate_to_heading: bool = parameter(
        True, help="turn in place towards a path that lies far off the robot's heading"
    )
    rotate_angle: float = parameter(
        1.0, "rad", above=0.0, help="turns in place when the path lies farther off than this"
    )
    rotate_speed: float = parameter(1.4, "rad/s", above=0.0, help="top speed of turns in place")
    goal_position: float = parameter(
        0.03, "m", above=0.0, help="distance at which it stops and turns to the goal's heading"
    )
    turn_speed: float = parameter(1.9, "rad/s", above=0.0, help="top turning speed")


class GoalAlignment:
    """Knows where on its path the robot is, and drives what is not driving along it.

    Attributes:
        track: progress on the path; None before the first.
        ramp: what the drive can do between two commands.
        last: the command given last.
    """

    def __init__(
        self, parameters: EndsParameters, robot: RobotDescription, swept: SweptFootprint,
        period: float,
    ) -> None:  # fmt: skip
        p = self._parameters = parameters
        self.ramp = Ramp(robot.limits, period, p.response_time, robot.turning_radius)
        style = TurnStyle(p.rotate_speed, p.brake_share, p.goal_heading)
        self._turn = TurnInPlace(swept, self.ramp, style)
        self._drive = robot.drive
        self._patience, self._arrival, self._shim = Patience(), Arrival(), RotationShim()
        self.track: PathProgress | None = None
        self.last = STANDSTILL
        self._held_steps, self._suspended, self._period = 0, 0.0, period

    def set_path(self, path: Path) -> None:
        """A new path to follow, map frame."""
        steered = self._drive is DriveKind.ACKERMANN
        self.track, self._shim = PathProgress(path, steered=steered), RotationShim()
        self._arrival.set_path(path)

    def begin(self, state: ControlState) -> PathProgress | None:
        """Take in where the robot is now; the track, None when there is no path."""
        if self.track is not None:
            self.track.advance(state.pose)
        self._note_hold(state.twist)
        self.last = self.ramp.rebased(self.last, state.twist)
        return self.track

    @property
    def held(self) -> bool:
        """Whether what was commanded has not been driven for a while.

        The last stage before the wheels then sees something in the way that the costmap does not.
        """
        return self._held_steps * self._period >= HELD

    def _note_hold(self, measured: Twist) -> None:
        wanted, driven = _rim_speed(self.last), _rim_speed(measured)
        if wanted > 0.05 and driven < 0.25 * wanted:
            self._held_steps += 1
            self._suspended = SUSPENDED if self.held else self._suspended
        else:
            self._held_steps = max(0, self._held_steps - 1)
            self._suspended = max(0.0, self._suspended - self._period)

    def reached(self, state: ControlState) -> bool:
        """Whether the goal's position is reached; for a car, whether its path is at its end.

        A car beside the end of its path would have to drive a circle to come nearer.
        """
        p = self._parameters
        if self._drive is DriveKind.ACKERMANN and self.track is not None:
            return self.track.remaining <= p.goal_position
        return self._arrival.reached(state.pose, p.goal_position)

    def way_left(self, state: ControlState) -> float:
        """Metres to brake in: to the goal, for a car to the end of its path."""
        if self.track is None:
            return 0.0
        if self._drive is DriveKind.ACKERMANN:
            return self.track.remaining
        return max(self.track.remaining, state.pose.distance_to(self.track.path.goal))

    def finish(self, state: ControlState) -> Twist | None:
        """At the goal: stop, and turn to its heading; None while that is blocked.

        A car only stops: its heading is the one that the path has brought.
        """
        if self._drive is DriveKind.ACKERMANN:
            return self.ramp.stopped(self.last)
        return self._turn.twist(state, self.last, self._heading_error(state))

    def turned(self, state: ControlState) -> Twist | None:
        """A turn towards a path that lies far off; None when it need not or cannot be made."""
        p = self._parameters
        if self.track is None or self._suspended or not self._turns_first(self.track):
            return None
        angle = self._shim.angle(self.track, state, p.rotate_angle, p.goal_position)
        return None if angle is None else self._turn.twist(state, self.last, angle)

    def _turns_first(self, track: PathProgress) -> bool:
        """Whether this robot turns towards a path: a car cannot, sideways is near enough to go."""
        if self._drive is DriveKind.OMNI and track.remaining <= LOOKAHEAD:
            return False
        return self._parameters.rotate_to_heading and self._drive is not DriveKind.ACKERMANN

    def realigned(self, state: ControlState) -> Twist | None:
        """A turn in place towards the path just ahead, for when nothing else is clear."""
        if self.track is None or self._drive is DriveKind.ACKERMANN:
            return None
        x, y = self.track.nearer_point(state.pose, JUST_AHEAD)
        angle = wrap_angle(state.pose.bearing_to(Pose2D(x, y)) - state.pose.heading)
        return None if abs(angle) <= ALIGNED else self._turn.twist(state, self.last, angle)

    def end(self, state: ControlState, chosen: Twist | None) -> Twist:
        """The command: what was chosen, or a standstill when nothing is safe.

        Raises:
            NavigationError: COLLISION_AHEAD when nothing was safe for `patience`.
        """
        self.last = STANDSTILL
        self.last = self._patience.bear(chosen, state.time, self._parameters.patience)
        return self.last

    def ramped(self, twist: Twist) -> Twist:
        """The twist as far as it can be reached in one control period."""
        return self.ramp.towards(self.last, twist)

    def _heading_error(self, state: ControlState) -> float:
        if self.track is None:
            return 0.0
        return wrap_angle(self.track.path.goal.heading - state.pose.heading)


def _rim_speed(twist: Twist) -> float:
    """How fast a point 0.2 m beside the middle of a robot moves at most, m/s."""
    return hypot(twist.linear, twist.lateral) + 0.2 * abs(twist.angular)
