"""Docking at a charger that the lidar sees."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from math import atan, atan2, cos, hypot, pi, sin
from typing import Any

from py_trees.common import Status

from behaviours._motion.driving import TIME_TO_LIVE, DrivingBehaviour
from behaviours._motion.odometry_trail import OdometryTrail
from behaviours._sensing.dock_fit import DockFitter
from behaviours.base import DRIVE_FAILURES, output, port
from stack.types import (
    ContactZone,
    DockShape,
    FailureCode,
    Footprint,
    Pose2D,
    TaskStatus,
    Twist,
    wrap_angle,
)

LEAST_FITS, PATIENCE = 4, 3.0
"""Scans in which the dock must be found before the robot drives to it; seconds for them."""

LEAST_GAIN = 0.1
"""Weight of a new measurement of the dock's pose, at least; the first ones are averaged."""

BLIND_TIME = 1.5
"""Seconds without a measurement after which an approach is given up."""

TARGET_BEYOND = 0.35
"""Metres behind the docked robot's base of the pose that the control law leads to: its turns get
sharper the nearer that is."""

STEERING_GAINS = 6.0, 20.0
BEND_SLOWS, BEND_POWER = 0.1, 1.0
"""k1, k2, beta and lambda of the control law."""

FASTEST_TURN, SLOWEST, SLOWER = 0.8, 0.03, 0.8
"""rad/s, m/s, and 1/s: speed per distance to go."""

AT_DOCK = 0.002
CHARGE_TIME = 3.0
"""Seconds in which the battery must begin to charge."""

STAGING = 0.6
"""Metres from the dock to the robot's front before the approach, by default."""

ZONE_MARGIN = 0.06
"""Metres around the dock in which what the lidar sees may be touched."""


class _Phase(Enum):
    STAGING = "driving to the place in front of the dock"
    LOOKING = "looking for the dock"
    APPROACH = "driving to the dock"
    CONTACT = "waiting for the battery to charge"
    BACKING = "backing off"


class Dock(DrivingBehaviour):
    """Drive to a charging dock until the battery charges.

    Drives to a place in front of the dock, measures the dock by its shape in the lidar's scans,
    drives to it under a smooth control law, and waits until the battery charges; otherwise it backs
    off and tries again. Fails with DOCK_NOT_FOUND if there is no dock where it should be, and with
    NOT_CHARGING if the battery does not charge after the last attempt.
    """

    also_known_as = ("charge", "recharge", "DockRobot")

    dock: Pose2D = port("middle of the dock's face and direction out of it, map frame")
    staging: float = port(
        "distance of the robot's front from the dock before the approach",
        unit="m", default=STAGING, at_least=0.3, at_most=1.5,
    )  # fmt: skip
    gap: float = port(
        "distance of the robot's front from the dock at the end",
        unit="m", default=0.02, at_least=0.0, at_most=0.2,
    )  # fmt: skip
    speed: float = port("speed of the approach", unit="m/s", default=0.1, above=0.0, at_most=0.3)
    tries: int = port("attempts", default=3, at_least=1)
    position_error: float = output("distance from the measured dock to the aimed at pose", unit="m")
    attempts: int = output("attempts made")

    needs = ("lidar",)
    claims = ("base",)
    takes_time = True
    fails_with = (*DRIVE_FAILURES, FailureCode.DOCK_NOT_FOUND, FailureCode.NOT_CHARGING)
    goal_ports = ("dock",)

    @classmethod
    def standing_pose(
        cls, pose: Pose2D, footprint: Footprint, ports: Mapping[str, Any]
    ) -> Pose2D | None:
        """Return the place in front of a dock, from which it is approached by sight."""
        staging = ports.get("staging")
        if staging is None:
            return None
        return pose.compose(Pose2D(footprint.front + staging, 0.0, pi))

    def initialise(self) -> None:
        self._front = self.robot.base.footprint.front
        self._fitter, self._shape = DockFitter(DockShape()), DockShape()
        self._trail, self._stamp = OdometryTrail(), self.robot.time
        self._timer, self._since_measured = self.start_timer(), self.start_timer()
        self._in_odom: Pose2D | None = None
        self._fits, self._attempt = 0, 1
        self.attempts = 1
        self.position_error = 0.0
        place = self.standing_pose(self.dock, self.robot.base.footprint, {"staging": self.staging})
        assert place is not None
        self._task = self.robot.base.navigate_to(place)
        self._phase = _Phase.STAGING

    def update(self) -> Status:
        self._trail.record(self.robot.time, self.robot.base.odometry)
        self.feedback_message = self._phase.value
        if self._phase in (_Phase.STAGING, _Phase.BACKING):
            return self._after_task()
        self._measure()
        if self._phase is _Phase.LOOKING:
            return self._look()
        if self._phase is _Phase.APPROACH:
            return self._approach()
        return self._confirm()

    def _enter(self, phase: _Phase) -> None:
        self._phase = phase
        self._timer.restart()

    def _after_task(self) -> Status:
        """Look for the dock when the drive is over; a drive back may have less room."""
        task, failure = self._task, self._task.failure
        if task.status is TaskStatus.RUNNING:
            return Status.RUNNING
        if task.status is not TaskStatus.SUCCEEDED and self._phase is _Phase.STAGING:
            code = FailureCode.FAILED if failure is None else failure.code
            return self.fail(code, "no place in front of the dock" if failure is None else
                             f"in front of the dock: {failure.sentence}")  # fmt: skip
        self._in_odom, self._fits = None, 0
        self._enter(_Phase.LOOKING)
        return Status.RUNNING

    def _measure(self) -> None:
        """Measure the dock in a new scan, and average."""
        scan = self.robot.perception.scan
        if scan is None or scan.stamp <= self._stamp:
            return
        self._stamp = scan.stamp
        here = self.robot.base.odometry
        points = self._trail.since(scan.stamp).inverse().transform(scan.points())
        guess = self.dock.relative_to(self.robot.localisation.pose)
        if self._in_odom is not None:
            guess = self._in_odom.relative_to(here)
        found = self._fitter.fit(points, guess)
        if found is None:
            return
        self._fits += 1
        pose = here.compose(found)
        self._in_odom = pose if self._in_odom is None else _blended(
            self._in_odom, pose, max(LEAST_GAIN, 1.0 / self._fits)
        )  # fmt: skip
        self._since_measured.restart()

    def _look(self) -> Status:
        if self._fits >= LEAST_FITS:
            self._enter(_Phase.APPROACH)
        elif self._timer.is_over(PATIENCE):
            return self._again(
                FailureCode.DOCK_NOT_FOUND,
                f"no dock within 0.3 m and 20 deg of [{self.dock.x:.2f}, {self.dock.y:.2f}]",
            )
        self.stand()
        return Status.RUNNING

    def _approach(self) -> Status:
        """Steer to the dock; it need not be measured in the last centimetres."""
        robot = self._pose_at_dock()
        to_go = robot.x - self._front - self.gap
        self.feedback_message = f"{100 * to_go:.0f} cm from the dock"
        if self._since_measured.is_over(BLIND_TIME):
            return self._again(FailureCode.DOCK_NOT_FOUND, "the dock was lost during the approach")
        if to_go <= AT_DOCK:
            self.position_error = hypot(to_go, robot.y)
            self._enter(_Phase.CONTACT)
            self.stand()
            return Status.RUNNING
        speed = min(self.speed, max(SLOWEST, SLOWER * to_go))
        target = Pose2D(self._front + self.gap - TARGET_BEYOND, 0.0, pi)
        self.robot.base.drive_for(steered(robot, target, speed), TIME_TO_LIVE, contact=self._zone())
        return Status.RUNNING

    def _confirm(self) -> Status:
        if self.robot.battery.charging:
            return Status.SUCCESS
        self.stand()
        if self._timer.is_over(CHARGE_TIME):
            return self._again(
                FailureCode.NOT_CHARGING, f"at the dock, but not charging after {CHARGE_TIME:g} s"
            )
        return Status.RUNNING

    def _again(self, code: FailureCode, sentence: str) -> Status:
        """Back off for another attempt, or fail after the last one."""
        if self._attempt >= self.tries:
            return self.fail(code, f"{sentence}; {self._attempt} attempts")
        self._attempt += 1
        self.attempts = self._attempt
        back = self._front + self.staging
        if self._in_odom is not None:
            back -= self._pose_at_dock().x
        self._task = self.robot.base.back_up(max(0.1, back))
        self._enter(_Phase.BACKING)
        return Status.RUNNING

    def _pose_at_dock(self) -> Pose2D:
        """Return the robot's pose in the dock's frame."""
        assert self._in_odom is not None
        return self.robot.base.odometry.relative_to(self._in_odom)

    def _zone(self) -> ContactZone:
        """Return the rectangle around the dock."""
        assert self._in_odom is not None
        depth = self._shape.depth + 2.0 * ZONE_MARGIN
        middle = self._in_odom.compose(Pose2D(-self._shape.depth / 2.0, 0.0))
        return ContactZone(middle, depth, self._shape.width + 2.0 * ZONE_MARGIN)


def steered(robot: Pose2D, target: Pose2D, speed: float) -> Twist:
    """Return the velocity that leads to a pose, slower in sharp turns.

    The control law of J. J. Park and B. Kuipers, "A Smooth Control Law for Graceful Motion of
    Differential Wheeled Mobile Robots in 2D Environment" (ICRA 2011), equations 13 and 15.

    Args:
        robot: pose.
        target: pose in the same frame.
        speed: on straight lines, m/s.
    """
    dx, dy = target.x - robot.x, target.y - robot.y
    distance, sight = max(hypot(dx, dy), 1e-3), atan2(dy, dx)
    delta, theta = wrap_angle(robot.heading - sight), wrap_angle(target.heading - sight)
    k1, k2 = STEERING_GAINS
    slope = 1.0 + k1 / (1.0 + (k1 * theta) ** 2)
    bend = -(k2 * (delta - atan(-k1 * theta)) + slope * sin(delta)) / distance
    linear = speed / (1.0 + BEND_SLOWS * abs(bend) ** BEND_POWER)
    turn = min(max(linear * bend, -FASTEST_TURN), FASTEST_TURN)
    return Twist(linear if cos(delta) > 0.0 else 0.0, turn)


def _blended(old: Pose2D, new: Pose2D, share: float) -> Pose2D:
    """Return a pose between two."""
    return Pose2D(
        old.x + share * (new.x - old.x), old.y + share * (new.y - old.y),
        wrap_angle(old.heading + share * wrap_angle(new.heading - old.heading)),
    )  # fmt: skip
