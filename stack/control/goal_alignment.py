"""Turns in place at the start of a path and to the goal's heading at its end.

Shared by the controllers that themselves only drive along the path.
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
from stack.drivetrain.description import RobotDescription
from stack.parameters import parameter
from stack.types import STANDSTILL, Path, Pose2D, Twist, wrap_angle

JUST_AHEAD = 0.2
"""Distance in metres of the path point that a blocked robot turns towards."""

HELD = 0.5
"""Seconds after which a robot that does not follow its commands counts as held."""

SUSPENDED = 2.0
"""Seconds of driving without a turn in place after one was held."""

ALIGNED = 0.1
"""Angle in radians to that point below which the robot does not turn."""


@dataclass(frozen=True)
class GoalAlignmentParameters(FollowingParameters):
    """Parameters of `GoalAlignment`, inherited by each controller that uses it."""

    rotate_to_heading: bool = parameter(
        True, help="turn in place towards the path before driving along it"
    )
    rotate_angle: float = parameter(
        1.0, "rad", above=0.0, help="angle to the path above which the robot turns in place"
    )
    rotate_speed: float = parameter(1.4, "rad/s", above=0.0, help="top speed of turns in place")
    goal_position: float = parameter(
        0.03, "m", above=0.0, help="distance to the goal at which the robot turns to its heading"
    )
    turn_speed: float = parameter(1.9, "rad/s", above=0.0, help="top turning speed")


class GoalAlignment:
    """Tracks the robot's progress on its path and commands the turns at both ends.

    Attributes:
        progress: progress on the path; None before the first path.
        ramp: limits of change between two commands.
        last: the last command.
        patience: waits for the path to clear.
    """

    def __init__(
        self, parameters: GoalAlignmentParameters, robot: RobotDescription, swept: SweptFootprint,
        period: float,
    ) -> None:  # fmt: skip
        p = self._parameters = parameters
        self.ramp = Ramp(robot.drivetrain, period, p.response_time)
        style = TurnStyle(p.rotate_speed, p.brake_share, p.goal_heading)
        self._turn = TurnInPlace(swept, self.ramp, style)
        self._drivetrain = robot.drivetrain
        self.patience, self._arrival, self._shim = Patience(), Arrival(), RotationShim()
        self.progress: PathProgress | None = None
        self.last = STANDSTILL
        self._held_steps, self._suspended, self._period = 0, 0.0, period

    def set_path(self, path: Path) -> None:
        """Set the path to follow, map frame."""
        steered = not self._drivetrain.turns_in_place
        self.progress, self._shim = PathProgress(path, steered=steered), RotationShim()
        self._arrival.set_path(path)

    def begin(self, state: ControlState) -> PathProgress | None:
        """Update the progress on the path; return it, None when there is no path."""
        if self.progress is not None:
            self.progress.advance(state.pose)
        self._note_hold(state.twist)
        self.last = self.ramp.rebased(self.last, state.twist)
        return self.progress

    @property
    def held(self) -> bool:
        """Whether the robot has not followed its commands for a while.

        The safety stage then sees an obstacle that the costmap does not contain.
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
        """Whether the goal's position is reached; for a car, whether the end of the path is.

        A car with a lateral offset from the goal would have to drive a circle to reduce it.
        """
        p = self._parameters
        if self._drivetrain.turns_in_place or self.progress is None:
            return self._arrival.reached(state.pose, p.goal_position)
        return self.progress.remaining <= p.goal_position

    def distance_left(self, state: ControlState) -> float:
        """Braking distance in metres: to the goal; for a car, to the end of its path."""
        if self.progress is None:
            return 0.0
        if not self._drivetrain.turns_in_place:
            return self.progress.remaining
        return max(self.progress.remaining, state.pose.distance_to(self.progress.path.goal))

    def finish(self, state: ControlState) -> Twist | None:
        """At the goal: stop and turn to its heading; None while the turn is blocked.

        A car only stops and keeps its heading.
        """
        if not self._drivetrain.turns_in_place:
            return self.ramp.stopped(self.last)
        return self._turn.twist(state, self.last, self._heading_error(state))

    def turned(self, state: ControlState) -> Twist | None:
        """A turn in place towards the path; None when it is not needed or not possible."""
        p = self._parameters
        if self.progress is None or self._suspended or not self._turns_first(self.progress):
            return None
        angle = self._shim.angle(self.progress, state, p.rotate_angle, p.goal_position)
        return None if angle is None else self._turn.twist(state, self.last, angle)

    def _turns_first(self, progress: PathProgress) -> bool:
        """Whether to turn first: not a car; not an omnidirectional robot close to the goal."""
        if self._drivetrain.can_move_sideways and progress.remaining <= LOOKAHEAD:
            return False
        return self._parameters.rotate_to_heading and self._drivetrain.turns_in_place

    def realigned(self, state: ControlState) -> Twist | None:
        """A turn in place towards the path just ahead, used when no other motion is clear."""
        if self.progress is None or not self._drivetrain.turns_in_place:
            return None
        x, y = self.progress.nearer_point(state.pose, JUST_AHEAD)
        angle = wrap_angle(state.pose.bearing_to(Pose2D(x, y)) - state.pose.heading)
        return None if abs(angle) <= ALIGNED else self._turn.twist(state, self.last, angle)

    def end(self, state: ControlState, chosen: Twist | None) -> Twist:
        """Return the chosen command, or a standstill when there is none.

        Raises:
            NavigationError: COLLISION_AHEAD when there was no safe command for `patience`.
        """
        self.last = STANDSTILL
        self.last = self.patience.resolve(chosen, state.time, self._parameters.patience)
        return self.last

    def ramped(self, twist: Twist) -> Twist:
        """Return the twist that is reachable in one control period."""
        return self.ramp.towards(self.last, twist)

    def _heading_error(self, state: ControlState) -> float:
        if self.progress is None:
            return 0.0
        return wrap_angle(self.progress.path.goal.heading - state.pose.heading)


def _rim_speed(twist: Twist) -> float:
    """Highest speed of a point 0.2 m from the robot's centre, m/s."""
    return hypot(twist.linear, twist.lateral) + 0.2 * abs(twist.angular)
