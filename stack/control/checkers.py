"""Goal checkers and progress checkers."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, pi

from stack.components import DriveState, GoalChecker, GoalTolerance, ProgressChecker
from stack.drivetrain.description import RobotDescription
from stack.lifecycle import Timers
from stack.parameters import parameter
from stack.types import Pose2D, wrap_angle

LEAST_SHARE = 0.5
"""Share of the way that a slow robot can make in the time, which it must make."""


@dataclass(frozen=True)
class SimpleGoalParameters:
    """Tolerances at the goal."""

    position: float = parameter(
        0.15, "m", above=0.0, public=True,
        help="position tolerance at the goal, unless a task sets its own",
    )  # fmt: skip
    heading: float = parameter(
        0.15, "rad", above=0.0, public=True, help="heading tolerance at the goal"
    )


class SimpleGoalChecker(GoalChecker):
    """Goal checker: reached as soon as position and heading are within their tolerances.

    While the robot turns to the final heading, the position tolerance is doubled.
    """

    Parameters = SimpleGoalParameters
    parameters: SimpleGoalParameters

    def __init__(self, parameters: SimpleGoalParameters, robot: RobotDescription) -> None:
        super().__init__(parameters, robot)
        self._goal: Pose2D | None = None
        self._tolerance: float | None = None
        self._at_position = False

    @property
    def at_position(self) -> bool:
        return self._at_position

    @property
    def tolerance(self) -> GoalTolerance:
        """Tolerances of the parameters, with the position tolerance of the task if it has one."""
        p = self.parameters
        position = p.position if self._tolerance is None else self._tolerance
        return GoalTolerance(position, p.heading)

    def set_goal(self, goal: Pose2D, tolerance: float | None) -> None:
        self._goal, self._tolerance, self._at_position = goal, tolerance, False

    def reached(self, state: DriveState) -> bool:
        if self._goal is None:
            return False
        limit, pose = self.tolerance, state.pose
        distance = pose.distance_to(self._goal)
        self._at_position = distance <= limit.position * (2.0 if self._at_position else 1.0)
        turned = abs(wrap_angle(self._goal.heading - pose.heading)) <= limit.heading
        return self._at_position and turned


@dataclass(frozen=True)
class StoppedGoalParameters(SimpleGoalParameters):
    """Parameters of `StoppedGoalChecker`."""

    settle: float = parameter(
        2.0, "s", at_least=0.0, help="after this time within tolerance a moving robot has arrived"
    )


class StoppedGoalChecker(SimpleGoalChecker):
    """Goal checker: reached when the robot stands within the tolerances.

    A controller that still moves inside the tolerances may finish; after `settle` seconds inside,
    the goal is reached in any case.
    """

    Parameters = StoppedGoalParameters
    parameters: StoppedGoalParameters

    def __init__(self, parameters: StoppedGoalParameters, robot: RobotDescription) -> None:
        super().__init__(parameters, robot)
        self._timers = Timers()
        self._settling = self._timers.new()

    def start(self, now: float) -> None:
        self._timers.resume(now)
        self._settling.reset()

    def pause(self, now: float) -> None:
        self._timers.pause(now)

    def resume(self, now: float) -> None:
        self._timers.resume(now)

    def set_goal(self, goal: Pose2D, tolerance: float | None) -> None:
        super().set_goal(goal, tolerance)
        self._settling.reset()

    def reached(self, state: DriveState) -> bool:
        if not super().reached(state):
            self._settling.reset()
            return False
        self._settling.start_once(state.time)
        return state.standing or self._settling.elapsed(state.time) >= self.parameters.settle


@dataclass(frozen=True)
class SimpleProgressParameters:
    """Parameters of `SimpleProgressChecker`."""

    distance: float = parameter(
        0.3, "m", above=0.0, public=True,
        help="distance that counts as progress; less for slow robots",
    )  # fmt: skip
    time: float = parameter(
        8.0, "s", above=0.0, public=True, help="a drive fails after this time without progress"
    )


class SimpleProgressChecker(ProgressChecker):
    """Progress checker: the robot must move by a distance in a time, or as far as it can.

    It may stay at one place while it gets ahead on its path, as a car that turns by driving to and
    fro: the rest of the path must become shorter by that distance than ever before in the drive.
    Each change of direction that is left counts as the parameter's distance. A slow robot must move
    half as far as it can in the time.
    """

    Parameters = SimpleProgressParameters
    parameters: SimpleProgressParameters

    def __init__(self, parameters: SimpleProgressParameters, robot: RobotDescription) -> None:
        super().__init__(parameters, robot)
        self._timers, self._limits = Timers(), robot.limits
        self._still = self._timers.new()
        self._place: Pose2D | None = None
        self._least = inf

    def start(self, now: float) -> None:
        self._timers.resume(now)
        self._place, self._least = None, inf

    def pause(self, now: float) -> None:
        self._timers.pause(now)

    def resume(self, now: float) -> None:
        self._timers.resume(now)

    @property
    def patience(self) -> float:
        return self.parameters.time

    def stuck(self, state: DriveState) -> str:
        p, limits = self.parameters, self._limits
        top = min(limits.linear_speed, state.top_speed)
        least = min(p.distance, LEAST_SHARE * _way(top, limits.linear_acceleration, p.time))
        left = state.remaining + p.distance * state.reversals
        if self._place is None or self._place.distance_to(state.pose) >= least:
            self._begin_at(state.pose)
            self._least = min(self._least, left)
            self._still.start(state.time)
        elif max(0.0, self._least - left) / least + self._turn_share(state.pose) >= 1.0 - 1e-9:
            self._least = min(self._least, left)
            self._count_turn()
            self._still.start(state.time)
        if self._still.elapsed(state.time) < p.time:
            return ""
        return f"moved less than {least:.2g} m in {p.time:g} s"

    def _begin_at(self, pose: Pose2D) -> None:
        """Measure from a new place."""
        self._place = pose

    def _turn_share(self, pose: Pose2D) -> float:
        """Turn at the same place that is not counted yet, as a share of one that is progress."""
        return 0.0

    def _count_turn(self) -> None:
        """Count the turn up to here."""


def _way(top: float, acceleration: float, time: float) -> float:
    """Return how far a robot that stands gets in a time: metres, or radians if it turns."""
    rise = min(time, top / acceleration)
    return top * (time - rise) + 0.5 * acceleration * rise**2


@dataclass(frozen=True)
class PoseProgressParameters(SimpleProgressParameters):
    """Parameters of `PoseProgressChecker`."""

    angle: float = parameter(
        0.4, "rad", above=0.0,
        help="turn that counts as progress, at one place once for each direction",
    )  # fmt: skip


class PoseProgressChecker(SimpleProgressChecker):
    """Progress checker: the robot must move by a distance, or turn to new headings, in a time.

    At one place a turn counts only while it leads beyond the headings that the robot has had there,
    and at most for a full turn. So a robot that turns to and fro before an obstacle, or round and
    round, makes no progress. A turn and a way that together are enough count too. A car that drives
    the distance to and fro must turn half as far as it does on its tightest circle.
    """

    Parameters = PoseProgressParameters
    parameters: PoseProgressParameters

    def __init__(self, parameters: PoseProgressParameters, robot: RobotDescription) -> None:
        super().__init__(parameters, robot)
        self._heading, self._radius = 0.0, robot.turning_radius
        self._turn = 0.0
        self._counted = (0.0, 0.0)

    def _begin_at(self, pose: Pose2D) -> None:
        super()._begin_at(pose)
        self._heading, self._turn, self._counted = pose.heading, 0.0, (0.0, 0.0)

    def _turn_share(self, pose: Pose2D) -> float:
        self._turn += wrap_angle(pose.heading - self._heading)
        self._heading = pose.heading
        (right, left), p, limits = self._counted, self.parameters, self._limits
        if left - right >= 2.0 * pi:
            return 0.0
        fastest = _way(limits.angular_speed, limits.angular_acceleration, p.time)
        if self._radius:
            fastest = min(fastest, p.distance / self._radius)
        return max(0.0, self._turn - left, right - self._turn) / min(p.angle, LEAST_SHARE * fastest)

    def _count_turn(self) -> None:
        right, left = self._counted
        self._counted = min(right, self._turn), max(left, self._turn)
