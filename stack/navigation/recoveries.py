"""Recovery motions by odometry and range sensors: spin, back up, drive straight, drive for a time.

They need no map and no pose, so they also work when map or pose are wrong. Each of them ends: done,
blocked, stalled or timed out.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from math import atan2, copysign, cos, degrees, inf, sin, sqrt

from stack.drivetrain.description import RobotDescription
from stack.drivetrain.limits import Limits
from stack.navigation.tasks import MotionExecutor, MotionTask
from stack.safety.monitor import CollisionMonitor
from stack.types import (
    STANDSTILL,
    ContactZone,
    FailureCode,
    Odometry,
    Perceived,
    Pose2D,
    Twist,
    wrap_angle,
)

RECOVERY_PADDING = 0.05
"""Distance kept around the footprint in recoveries, m."""
RECOVERY_PATIENCE = 2.0
"""A blocked recovery waits this long, then fails, s."""
STALL_TIME = 3.0
"""A recovery that does not move for this long fails, s."""

DONE = 0.02
"""Remaining metres or radians at which a motion is complete: half a slow control step."""


@dataclass(frozen=True, slots=True)
class RecoveryTools:
    """Components used by recoveries: robot, collision monitor, control period (s)."""

    robot: RobotDescription
    monitor: CollisionMonitor
    period: float


@dataclass(frozen=True, slots=True)
class MotionProfile:
    """Trapezoidal speed profile of a recovery with one degree of freedom.

    Attributes:
        total: metres or radians to drive, positive.
        speed: top speed, m/s or rad/s.
        acceleration: of speeding up and braking, m/s² or rad/s².
        look_ahead: distance ahead that must be clear, metres or radians.
        unit: of the feedback.
    """

    total: float
    speed: float
    acceleration: float
    look_ahead: float
    unit: str

    @property
    def deadline(self) -> float:
        """Time limit in seconds: three times the expected duration, plus 5 s."""
        return 3.0 * (self.total / self.speed + self.speed / self.acceleration) + 5.0

    def next_rate(self, rate: float, remaining: float, period: float) -> float:
        """Return the rate for the next control step: accelerate, then brake towards the end."""
        rise = rate + self.acceleration * period
        delay = self.acceleration * 2.0 * period
        fall = sqrt(delay * delay + self.acceleration * remaining) - delay
        return min(self.speed, rise, max(fall, 0.1 * self.speed))


class Recovery(MotionExecutor):
    """A motion with one degree of freedom and a trapezoidal speed profile.

    Subclasses define how odometry measures the motion and which twist drives it.
    """

    def __init__(self, task: MotionTask, profile: MotionProfile, tools: RecoveryTools) -> None:
        super().__init__(task)
        self._profile, self._tools, self._rate = profile, tools, 0.0
        self._total, self._stall, self._block = (self.timers.new() for _ in range(3))
        self._done = self._best = 0.0
        self._blocked_at = 0.0

    @abstractmethod
    def _measure(self, odometry: Odometry) -> float:
        """Return the distance or angle driven so far, metres or radians."""

    @abstractmethod
    def _twist(self, rate: float) -> Twist:
        """Return the twist that drives the motion at this rate."""

    def start(self, now: float) -> None:
        self._total.start(now)
        self._stall.start(now)

    def resume(self, now: float) -> None:
        super().resume(now)
        self._rate = 0.0

    def step(self, perceived: Perceived) -> Twist:
        self._done = self._measure(perceived.motion)
        remaining = self._profile.total - self._done
        self.task.report(f"{max(0.0, remaining):.2f} {self._profile.unit} to go", remaining)
        if remaining <= DONE:
            return self._finish(perceived)
        if self._ended_early(perceived):
            return STANDSTILL
        if self._blocked(perceived, remaining):
            self._rate = 0.0
            return STANDSTILL
        self._rate = self._profile.next_rate(self._rate, remaining, self._tools.period)
        return self._twist(self._rate)

    def _finish(self, perceived: Perceived) -> Twist:
        if perceived.motion.twist.stands:
            self.task.succeed(f"done, {self._done:.2f} {self._profile.unit}")
        return STANDSTILL

    def _ended_early(self, perceived: Perceived) -> bool:
        """Fail when the robot has stalled or the deadline has passed."""
        if self._done > self._best + DONE:
            self._best = self._done
            self._stall.start(perceived.time)
        driven = f"drove {self._done:.2f} of {self._profile.total:.2f} {self._profile.unit}"
        if self._stall.elapsed(perceived.time) >= STALL_TIME:
            self.task.fail(
                FailureCode.NO_PROGRESS,
                f"did not move for {STALL_TIME:g} s; {driven}",
            )
        elif self._total.elapsed(perceived.time) >= self._profile.deadline:
            self.task.fail(
                FailureCode.TIMED_OUT, f"not done after {self._profile.deadline:.1f} s; {driven}"
            )
        return not self.task.running

    def _blocked(self, perceived: Perceived, remaining: float) -> bool:
        """Whether an obstacle is in the way; the task fails when patience is over."""
        points = perceived.obstacles.points
        ahead = min(remaining, self._profile.look_ahead)
        contact = self._tools.monitor.contact(self._twist(1.0), points, ahead, RECOVERY_PADDING)
        if contact.time == inf:
            if self._done > self._blocked_at + DONE:  # noise alone must not restart the patience
                self._block.reset()
            return False
        if not self._block.running:
            self._block.start(perceived.time)
            self._blocked_at = self._done
        if self._block.elapsed(perceived.time) >= RECOVERY_PATIENCE:
            self.task.fail(
                FailureCode.COLLISION_AHEAD,
                f"an obstacle {contact.place} is in the way, contact in {contact.time:.2f} "
                f"{self._profile.unit}; drove {self._done:.2f} of {self._profile.total:.2f} "
                f"{self._profile.unit}",
            )
        return True


class SpinMotion(Recovery):
    """Turns in place by an angle, which may be more than a full turn.

    The angle is accumulated over the steps; the turn in one step is far below half a turn.
    """

    def __init__(self, task: MotionTask, angle: float, speed: float, tools: RecoveryTools) -> None:
        limits = tools.robot.limits
        top = min(speed, limits.angular_speed)
        profile = MotionProfile(abs(angle), top, 0.5 * limits.angular_acceleration, 0.35, "rad")
        super().__init__(task, profile, tools)
        self._sign = copysign(1.0, angle)
        self._heading: float | None = None

    @staticmethod
    def unsupported_reason(robot: RobotDescription) -> str:
        """Reason why a robot cannot turn in place; empty when it can."""
        radius = robot.turning_radius
        if not radius:
            return ""
        return (
            f"the {robot.name} steers like a car and cannot turn in place: its turning radius is "
            f"{radius:.2f} m; use free_space_escape or back_up instead"
        )

    def _measure(self, odometry: Odometry) -> float:
        heading = odometry.pose.heading
        if self._heading is not None:
            self._done += self._sign * wrap_angle(heading - self._heading)
        self._heading = heading
        return self._done

    def _twist(self, rate: float) -> Twist:
        return Twist(angular=self._sign * rate)


class BackUpMotion(Recovery):
    """Drives straight back by a distance."""

    def __init__(
        self, task: MotionTask, distance: float, speed: float, tools: RecoveryTools
    ) -> None:
        limits = tools.robot.limits
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
class StraightLine:
    """A straight line to drive without turning first.

    Attributes:
        distance: metres; negative: opposite to the direction.
        direction: of the line in the base frame, radians; 0 except for omnidirectional robots.
        speed: m/s.
    """

    distance: float
    direction: float
    speed: float

    @staticmethod
    def along(twist: Twist, speed: float) -> StraightLine:
        """A line of 1 m in the direction of a twist."""
        return StraightLine(1.0, atan2(twist.lateral, twist.linear), speed)

    @property
    def unit(self) -> tuple[float, float]:
        """Unit vector (forward, left) of the direction of travel, base frame."""
        sign = copysign(1.0, self.distance)
        return sign * cos(self.direction), sign * sin(self.direction)

    def unsupported_reason(self, robot: RobotDescription) -> str:
        """Reason why a robot cannot drive the line; empty when it can."""
        if self.direction and not robot.drivetrain.can_move_sideways:
            return (
                f"the {robot.name} has {robot.drivetrain.kind} wheels and cannot drive towards "
                f"{degrees(self.direction):.0f} deg without turning first; omit the direction"
            )
        if self.top_speed(robot.limits) <= 0.0:
            return (
                f"the {robot.name} cannot drive in that direction: its speed limit there is 0 m/s"
            )
        return ""

    def top_speed(self, limits: Limits) -> float:
        """Top speed of the drive in this direction, m/s; 0 when it cannot drive there."""
        forward, left = self.unit
        along = limits.linear_speed if forward > 0.0 else limits.reverse_speed
        tops = [self.speed]
        if abs(forward) > 1e-9:
            tops.append(along / abs(forward))
        if abs(left) > 1e-9:
            tops.append(limits.lateral_speed / abs(left))
        return min(tops)


class DriveOnHeadingMotion(Recovery):
    """Drives straight by a distance and holds its initial heading by odometry."""

    STEERING = 2.0
    """Steering gain: curvature per radian of heading error, 1/m."""
    TIGHTEST = 4.0
    """Maximum curvature, 1/m; less if the robot's turning radius requires it."""

    def __init__(self, task: MotionTask, line: StraightLine, tools: RecoveryTools) -> None:
        limits, robot = tools.robot.limits, tools.robot
        speed = line.top_speed(limits)
        profile = MotionProfile(
            abs(line.distance), speed, 0.5 * limits.linear_acceleration, 0.25, "m"
        )
        super().__init__(task, profile, tools)
        self._unit, self._off = line.unit, 0.0
        self._start: Pose2D | None = None
        self._sideways = robot.drivetrain.can_move_sideways
        radius = robot.turning_radius
        self._tightest = min(self.TIGHTEST, 1.0 / radius) if radius else self.TIGHTEST

    def _measure(self, odometry: Odometry) -> float:
        if self._start is None:
            self._start = odometry.pose
        motion = odometry.pose.relative_to(self._start)
        self._off = motion.heading
        return motion.x * self._unit[0] + motion.y * self._unit[1]

    def _twist(self, rate: float) -> Twist:
        forward, left = self._unit
        steer = min(self._tightest, max(-self._tightest, -self.STEERING * self._off))
        if self._sideways:  # stay on the line even with a heading error
            c, s = cos(self._off), sin(self._off)
            forward, left = c * forward + s * left, c * left - s * forward
        return Twist(rate * forward, rate * steer, rate * left)


@dataclass(frozen=True, slots=True)
class DriveOrder:
    """A velocity that a behaviour drives.

    Attributes:
        twist: base frame.
        seconds: for which it is driven.
        contact: where the robot may touch something.
        gives_way: whether it leaves the way of people who walk towards the robot.
        while_lost: drive also while the robot is lost.
    """

    twist: Twist
    seconds: float
    contact: ContactZone | None = None
    gives_way: bool = False
    while_lost: bool = False


class DriveForMotion(MotionExecutor):
    """Drives a velocity with a time to live, renewed by behaviours with their own control loop.

    Attributes:
        order: the newest.
    """

    def __init__(self, task: MotionTask, order: DriveOrder, now: float) -> None:
        super().__init__(task)
        self._age = self.timers.new()
        self.renew(order, now)

    def renew(self, order: DriveOrder, now: float) -> None:
        """Drive another velocity from now on, seconds."""
        self.timers.resume(now)
        self.order, self.while_lost = order, order.while_lost
        self._age.start(now)

    def step(self, perceived: Perceived) -> Twist:
        if self._age.elapsed(perceived.time) >= self.order.seconds - 1e-9:
            self.task.succeed("done")
            return STANDSTILL
        self.task.report("driving on command", 0.0)
        return self.order.twist
