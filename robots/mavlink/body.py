"""Body of a rover behind MAVLink: ArduRover in GUIDED, PX4 in OFFBOARD.

It connects, checks, arms and sets the mode before the run begins, and stops and disarms at its end.
Its time is the monotonic clock of this computer since then; the rover's stamps are converted to it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from time import monotonic, sleep  # noqa: TID251 - a real robot's clock
from typing import Any

from robots.mavlink.checks import LAST, OLDEST_ODOMETRY, READ, Check, Subject, checks_of
from robots.mavlink.estimates import EstimateSender
from robots.mavlink.measurements import Measurements
from robots.mavlink.parameters import MavlinkParameters
from robots.mavlink.rover_link import Order, Phase, RoverLink
from robots.mavlink.streaming import LinkThread
from stack.body import AcceptsEstimate, Body, BodyCommand, BodyHealth, Engageable
from stack.drivetrain.description import RobotDescription
from stack.errors import BodyError, InputError
from stack.mavlink.address import read_address
from stack.sim.pace import Pace
from stack.types import (
    STANDSTILL,
    Imu,
    Measurement,
    Observation,
    Odometry,
    Pose2D,
    PoseEstimate,
)

WANTED = (
    (30, 20.0),  # ATTITUDE
    (32, 20.0),  # LOCAL_POSITION_NED
    (9000, 20.0),  # WHEEL_DISTANCE
    (27, 50.0),  # RAW_IMU
    (105, 50.0),  # HIGHRES_IMU
    (330, 10.0),  # OBSTACLE_DISTANCE
    (132, 10.0),  # DISTANCE_SENSOR
    (147, 1.0),  # BATTERY_STATUS
    (1, 1.0),  # SYS_STATUS
)
"""Messages that the rover is asked to send, by id, and their rates, Hz."""

POLL = 0.05
"""Seconds between two looks while the body waits for the rover."""

SETTLE = 1.5
"""Seconds after the rover was found within which others on the link are noticed."""

CLOSING = 5.0
"""Longest time, seconds, to stop and disarm the rover at the end."""

STOOD_FOR = 1.0
"""Seconds of standstill orders after which small measured velocities are noise."""


class MavlinkBody(Body, Engageable, AcceptsEstimate):
    """Drives a rover.

    Args:
        description: of the robot.
        parameters: of the body.
        start: pose at which the rover stands, map frame.
        tell: writes a line for people: the autopilot's own texts, and the checks.
        interrupted: whether the user has given up waiting.

    Raises:
        InputError: the robot cannot be driven over MAVLink, or a parameter does not fit it.
        BodyError: there is no rover, or it may not drive; names the check that failed.
    """

    def __init__(
        self, description: RobotDescription, parameters: MavlinkParameters, *,
        start: Pose2D = Pose2D(0.0, 0.0), tell: Callable[[str], None] = lambda line: None,
        interrupted: Callable[[], bool] = lambda: False,
    ) -> None:  # fmt: skip
        _check_fit(description, parameters)
        self._description, self._parameters, self._tell = description, parameters, tell
        self._interrupted = interrupted
        self._measurements = Measurements(
            description, parameters.odometry, parameters.obstacle_distance, parameters.rangefinders
        )
        self._began, self._pace = 0.0, Pace(1.0)
        self._engagement, self._stood_since = 0, monotonic()
        self._seen: dict[str, float] = {}
        self.checks: list[Check] = []
        self._estimates = (
            None if parameters.estimate == "none" else EstimateSender(parameters.estimate, start)
        )
        link = RoverLink(
            read_address(parameters.connect), own_system=parameters.own_system,
            system=parameters.system, autopilot=parameters.autopilot, wanted=WANTED, read=READ,
            origin=parameters.origin, now=monotonic(),
        )  # fmt: skip
        if self._estimates is not None:
            link.estimate = self._estimates.message
        self._link, self._thread = link, LinkThread(link)
        try:
            self._connect()
            self._take_control()
        except BaseException:
            self.close()
            raise
        self._began = monotonic()

    # Before the run.

    def _connect(self) -> None:
        """Wait until the rover is heard.

        Raises:
            BodyError: it is not, in time.
        """
        self._wait(lambda: self._link.rover is not None, self._parameters.connect_timeout)
        self._refuse_failures(("heartbeat",))
        self._wait(lambda: bool(self._link.heard.others), SETTLE)
        self._refuse_failures(("one rover",))

    def _take_control(self) -> None:
        """Wait until all checks pass; ask for the mode and to be armed once the others do.

        Raises:
            BodyError: a check still fails after the time limit.
        """

        def ready() -> bool:
            failed = [check.name for check in self._checked() if not check.passed]
            if self._engagement == 0 and all(name in LAST for name in failed):
                self._engagement = 1
            return self._link.phase is Phase.DRIVING and not failed

        self._wait(ready, self._parameters.arm_timeout)
        self._refuse_failures(tuple(check.name for check in self.checks))
        for check in self.checks:
            self._tell(str(check))

    def _wait(self, done: Callable[[], bool], longest: float) -> None:
        """Wait at most `longest` seconds until something is so; hold the rover at a standstill."""
        until = monotonic() + longest
        while not done() and monotonic() < until:
            if self._interrupted():
                raise BodyError("interrupted while waiting for the rover")
            self._order(STANDSTILL.linear, STANDSTILL.angular)
            self._receive()
            sleep(POLL)

    def _checked(self) -> list[Check]:
        subject = Subject(self._link, self._measurements, self._parameters, monotonic())
        self.checks = checks_of(subject)
        return self.checks

    def _refuse_failures(self, names: tuple[str, ...]) -> None:
        failed = [str(c) for c in self._checked() if not c.passed and c.name in names]
        if failed:
            raise BodyError(f"the rover may not drive: {'; '.join(failed)}")

    # The run.

    @property
    def description(self) -> RobotDescription:
        """Description of the robot."""
        return self._description

    @property
    def time(self) -> float:
        """Seconds since the run began."""
        return monotonic() - self._began

    @property
    def is_real_time(self) -> bool:
        """Time passes by itself."""
        return True

    @property
    def health(self) -> BodyHealth:
        """Why the rover does not obey or measure; empty if it does."""
        problem = self._link.problem
        stamp = self._measurements.odometry.stamp
        if not problem and stamp is not None and monotonic() - stamp > OLDEST_ODOMETRY:
            problem = f"no odometry from the rover: {self._measurements.source} do not come"
        return BodyHealth(problem)

    def sense(self) -> Observation:
        """Return the measurements since the last call; odometry always, for this time."""
        self._receive()
        now = monotonic()
        time = now - self._began
        found: dict[str, Measurement] = {}
        for name, measured in self._measurements.take().items():
            shifted = _shifted(measured, self._began, time)
            if shifted is not None and shifted.stamp > self._seen.get(name, 0.0):
                self._seen[name] = shifted.stamp
                found[name] = shifted
        stands = now - self._stood_since > STOOD_FOR
        odometry = self._measurements.odometry.at(now, stands)
        found["wheels"] = replace(odometry, stamp=time)
        return Observation(time, found)

    def command(self, command: BodyCommand) -> None:
        """Drive a velocity until the next command, at most DEAD_MAN seconds."""
        twist = self._description.drivetrain.feasible(command.twist)
        self._order(twist.linear, twist.angular)

    def _order(self, linear: float, angular: float) -> None:
        if linear or angular:
            self._stood_since = monotonic()
        self._thread.order(Order(linear, angular, self._engagement))

    def _receive(self) -> None:
        for item in self._thread.take():
            self._measurements.add(item)
        for text in self._link.heard.take_texts():
            self._tell(f"autopilot: {text}")

    def engage(self) -> str:
        """Ask for the mode and to be armed again; a rover that is not heard cannot be asked."""
        if self._link.phase in (Phase.SEARCHING, Phase.LOST):
            return self._link.problem
        if self._link.phase not in (Phase.DRIVING, Phase.ENGAGING):
            self._engagement += 1
        return ""

    def accept_estimate(self, estimate: PoseEstimate, motion: Odometry) -> None:
        """Send the pose to the rover, if it shall know it."""
        if self._estimates is not None:
            self._estimates.accept(estimate, motion.twist, monotonic())

    def wait(self, period: float) -> None:
        """Sleep until the next control period begins."""
        self._pace.advance(period)
        self._pace.rest()

    def close(self) -> None:
        """Stop and disarm the rover, and disconnect. Safe to call twice."""
        until = monotonic() + CLOSING
        self._engagement = 0
        while self._link.phase in (Phase.ENGAGING, Phase.DRIVING, Phase.RELEASING):
            self._order(0.0, 0.0)
            if monotonic() > until:
                self._tell("the rover did not confirm that it is disarmed")
                break
            sleep(POLL)
        self._thread.close()


def _check_fit(robot: RobotDescription, parameters: MavlinkParameters) -> None:
    """Check that a robot can be driven by velocities forward and about the vertical axis.

    Raises:
        InputError: it cannot, or a sensor is named that it does not have.
    """
    if robot.drivetrain.can_move_sideways:
        raise InputError(
            "body mavlink: autopilots take no sideways velocity; describe the drive as differential"
        )
    if parameters.odometry == "wheels" and (
        robot.drivetrain.track == 0.0 or robot.drivetrain.steering_joints
    ):
        raise InputError(
            "body mavlink: odometry: wheels needs wheels on two sides that do not steer",
            "use `odometry: ekf`",
        )
    for name in parameters.rangefinders:
        if name not in robot.sonars:
            raise InputError(
                f"body mavlink: rangefinders: the robot has no sonar {name!r}",
                f"its sonars: {', '.join(robot.sonars) or 'none'}",
            )


def _shifted(measured: Any, began: float, now: float) -> Any:
    """Return a measurement with stamps since the run began; None if it was made before."""
    if isinstance(measured, Imu):
        stamps = measured.stamps - began
        during = (stamps > 0.0) & (stamps <= now)
        if not during.any():
            return None
        return Imu(
            stamps[during], measured.angular_velocity[during], measured.linear_acceleration[during]
        )
    stamp = measured.stamp - began
    return replace(measured, stamp=stamp) if 0.0 < stamp <= now else None
