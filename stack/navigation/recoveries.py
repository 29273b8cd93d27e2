"""Short motions by odometry and lidar alone: spin, back up, drive straight, drive for a while.

They need no map and no pose, so that they work when those are what is wrong. Every one of them
ends: done, blocked, stalled or out of time.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from math import atan2, copysign, cos, degrees, inf, sin, sqrt

from stack.drivetrain.description import DriveKind, Limits, RobotDescription
from stack.navigation.following import standing
from stack.navigation.parameters import NavigationParameters
from stack.navigation.tasks import MotionTask, NavigationState
from stack.safety.monitor import CollisionMonitor
from stack.types import STANDSTILL, FailureCode, Odometry, Pose2D, Twist, wrap_angle

DONE = 0.02
"""Metres or radians left that count as none: half a slow control step."""


@dataclass(frozen=True, slots=True)
class RecoveryTools:
    """What recoveries work with: the robot, settings, eyes and the control period (s)."""

    robot: RobotDescription
    parameters: NavigationParameters
    monitor: CollisionMonitor
    period: float

    @property
    def limits(self) -> Limits:
        """What the drive can do."""
        return self.robot.limits


@dataclass(frozen=True, slots=True)
class MotionProfile:
    """How a recovery moves in its one degree of freedom.

    Attributes:
        total: metres or radians to go, positive.
        speed: top speed, per second.
        acceleration: likewise, both ways.
        look_ahead: way ahead that must be clear.
        unit: for the feedback.
    """

    total: float
    speed: float
    acceleration: float
    look_ahead: float
    unit: str

    @property
    def deadline(self) -> float:
        """Seconds that are enough for it, three times over."""
        return 3.0 * (self.total / self.speed + self.speed / self.acceleration) + 5.0

    def next_rate(self, rate: float, remaining: float, period: float) -> float:
        """The rate for the next control step, speeding up, and slowing down towards the end."""
        rise = rate + self.acceleration * period
        late = self.acceleration * 2.0 * period
        fall = sqrt(late * late + self.acceleration * remaining) - late
        return min(self.speed, rise, max(fall, 0.1 * self.speed))


class Recovery(ABC):
    """A motion in one degree of freedom with a trapezoid speed profile.

    Subclasses say how odometry measures it and which twist makes it.
    """

    def __init__(self, task: MotionTask, profile: MotionProfile, tools: RecoveryTools) -> None:
        self.task = task
        self._stroke, self._tools, self._rate = profile, tools, 0.0
        self._began: float | None = None
        self._done = self._best = 0.0
        self._best_at = 0.0
        self._blocked_since: float | None = None
        self._blocked_at = 0.0

    @abstractmethod
    def _measure(self, odometry: Odometry) -> float:
        """How far it has come, metres or radians."""

    @abstractmethod
    def _twist(self, rate: float) -> Twist:
        """The twist that makes it at this rate."""

    def advance(self, state: NavigationState) -> Twist:
        """The velocity for this step."""
        self._done = self._measure(state.odometry)
        if self._began is None:
            self._began = self._best_at = state.time
        remaining = self._stroke.total - self._done
        self.task.report(f"{max(0.0, remaining):.2f} {self._stroke.unit} to go", remaining)
        if remaining <= DONE:
            return self._finish(state)
        if self._ended_early(state):
            return STANDSTILL
        if self._blocked(state, remaining):
            self._rate = 0.0
            return STANDSTILL
        self._rate = self._stroke.next_rate(self._rate, remaining, self._tools.period)
        return self._twist(self._rate)

    def _finish(self, state: NavigationState) -> Twist:
        if standing(state.odometry.twist):
            self.task.succeed(f"done, {self._done:.2f} {self._stroke.unit}")
        return STANDSTILL

    def _ended_early(self, state: NavigationState) -> bool:
        """Fail when it has stalled or its time is over."""
        if self._done > self._best + DONE:
            self._best, self._best_at = self._done, state.time
        came = f"came {self._done:.2f} of {self._stroke.total:.2f} {self._stroke.unit}"
        if state.time - self._best_at >= self._tools.parameters.stall_time:
            self.task.fail(
                FailureCode.NO_PROGRESS,
                f"did not move for {self._tools.parameters.stall_time:g} s; {came}",
            )
        elif self._began is not None and state.time - self._began >= self._stroke.deadline:
            self.task.fail(
                FailureCode.TIMED_OUT, f"not done after {self._stroke.deadline:.1f} s; {came}"
            )
        return not self.task.running

    def _blocked(self, state: NavigationState, remaining: float) -> bool:
        """Whether something stands in its way; fails once patience is over."""
        if state.scan is None:
            return False
        points = self._tools.monitor.points(state.scan, state.time, state.odometry.twist)
        ahead = min(remaining, self._stroke.look_ahead)
        contact = self._tools.monitor.contact(
            self._twist(1.0), points, ahead, self._tools.parameters.recovery_padding
        )
        if contact.time == inf:
            if self._done > self._blocked_at + DONE:  # not for noise that lets it look clear
                self._blocked_since = None
            return False
        if self._blocked_since is None:
            self._blocked_since, self._blocked_at = state.time, self._done
        if state.time - self._blocked_since >= self._tools.parameters.recovery_patience:
            self.task.fail(
                FailureCode.COLLISION_AHEAD,
                f"something {contact.time:.2f} {self._stroke.unit} on is in the way; came "
                f"{self._done:.2f} of {self._stroke.total:.2f} {self._stroke.unit}",
            )
        return True


class Spin(Recovery):
    """Turns in place by an angle, which may be more than a full turn.

    The angle is summed up from step to step, so that there is no heading at which it can miss its
    end (a turn between two steps is far below half a turn).
    """

    def __init__(self, task: MotionTask, angle: float, speed: float, tools: RecoveryTools) -> None:
        limits = tools.limits
        top = min(speed, limits.angular_speed)
        profile = MotionProfile(abs(angle), top, 0.5 * limits.angular_acceleration, 0.35, "rad")
        super().__init__(task, profile, tools)
        self._sign = copysign(1.0, angle)
        self._heading: float | None = None

    @staticmethod
    def why_not(robot: RobotDescription) -> str:
        """Why a robot cannot turn in place; empty when it can."""
        radius = robot.turning_radius
        if not radius:
            return ""
        return (
            f"the {robot.name} steers like a car and cannot turn in place: its tightest circle has "
            f"a radius of {radius:.2f} m; use free_space_escape or back_up instead"
        )

    def _measure(self, odometry: Odometry) -> float:
        heading = odometry.pose.heading
        if self._heading is not None:
            self._done += self._sign * wrap_angle(heading - self._heading)
        self._heading = heading
        return self._done

    def _twist(self, rate: float) -> Twist:
        return Twist(angular=self._sign * rate)


class BackUp(Recovery):
    """Drives straight back by a distance."""

    def __init__(
        self, task: MotionTask, distance: float, speed: float, tools: RecoveryTools
    ) -> None:
        limits = tools.limits
        top = min(speed, limits.reverse_speed)
        profile = MotionProfile(distance, top, 0.5 * limits.linear_acceleration, 0.25, "m")
        super().__init__(task, profile, tools)
        self._start: Pose2D | None = None

    def _measure(self, odometry: Odometry) -> float:
        pose = odometry.pose
        if self._start is None:
            self._start = pose
        dx, dy = pose.x - self._start.x, pose.y - self._start.y
        return -(dx * cos(self._start.heading) + dy * sin(self._start.heading))

    def _twist(self, rate: float) -> Twist:
        return Twist(-rate)


@dataclass(frozen=True, slots=True)
class StraightWay:
    """A straight line to drive, without a turn before it.

    Attributes:
        distance: metres; negative is the other way.
        direction: of the line in the base frame, radians; 0 but for omnidirectional robots.
        speed: m/s.
    """

    distance: float
    direction: float
    speed: float

    @staticmethod
    def along(twist: Twist, speed: float) -> StraightWay:
        """A metre the way that a twist leads."""
        return StraightWay(1.0, atan2(twist.lateral, twist.linear), speed)

    @property
    def unit(self) -> tuple[float, float]:
        """Forward and left parts of the direction of travel, base frame."""
        sign = copysign(1.0, self.distance)
        return sign * cos(self.direction), sign * sin(self.direction)

    def why_not(self, robot: RobotDescription) -> str:
        """Why a robot's drive cannot make it; empty when it can."""
        if self.direction and robot.drive is not DriveKind.OMNI:
            return (
                f"the {robot.name} has {robot.drive} wheels and cannot drive towards "
                f"{degrees(self.direction):.0f} deg without turning first; leave the direction out"
            )
        if self.top_speed(robot.limits) <= 0.0:
            return f"the {robot.name} cannot drive that way: its speed limit there is 0 m/s"
        return ""

    def top_speed(self, limits: Limits) -> float:
        """The speed within what the drive can do in this direction, m/s; 0 when it cannot."""
        forward, left = self.unit
        along = limits.linear_speed if forward > 0.0 else limits.reverse_speed
        tops = [self.speed]
        if abs(forward) > 1e-9:
            tops.append(along / abs(forward))
        if abs(left) > 1e-9:
            tops.append(limits.lateral_speed / abs(left))
        return min(tops)


class DriveOnHeading(Recovery):
    """Drives straight by a distance and holds the heading that it began with, by odometry."""

    STEERING = 2.0
    """Curvature for each radian that it is off its heading, 1/m."""
    TIGHTEST = 4.0
    """The most curvature that it steers with, 1/m; less where the robot cannot."""

    def __init__(self, task: MotionTask, way: StraightWay, tools: RecoveryTools) -> None:
        limits, robot = tools.limits, tools.robot
        speed = way.top_speed(limits)
        profile = MotionProfile(
            abs(way.distance), speed, 0.5 * limits.linear_acceleration, 0.25, "m"
        )
        super().__init__(task, profile, tools)
        self._unit, self._start, self._off = way.unit, Pose2D(0.0, 0.0), 0.0
        self._sideways = robot.drive is DriveKind.OMNI
        radius = robot.turning_radius
        self._tightest = min(self.TIGHTEST, 1.0 / radius) if radius else self.TIGHTEST

    def _measure(self, odometry: Odometry) -> float:
        if self._began is None:
            self._start = odometry.pose
        come = odometry.pose.relative_to(self._start)
        self._off = come.heading
        return come.x * self._unit[0] + come.y * self._unit[1]

    def _twist(self, rate: float) -> Twist:
        forward, left = self._unit
        steer = min(self._tightest, max(-self._tightest, -self.STEERING * self._off))
        if self._sideways:  # keep to the line even while the heading is off it
            c, s = cos(self._off), sin(self._off)
            forward, left = c * forward + s * left, c * left - s * forward
        return Twist(rate * forward, rate * steer, rate * left)


class DriveFor:
    """A velocity with a time to live, renewed by whoever closes a loop of their own."""

    def __init__(self, task: MotionTask, twist: Twist, until: float) -> None:
        self.task = task
        self.renew(twist, until)

    def renew(self, twist: Twist, until: float) -> None:
        """Drive another velocity, until another time."""
        self._twist, self._until = twist, until

    def advance(self, state: NavigationState) -> Twist:
        """The velocity, until its time is over."""
        if state.time >= self._until - 1e-9:
            self.task.succeed("its time is over")
            return STANDSTILL
        self.task.report("driving on command", 0.0)
        return self._twist
