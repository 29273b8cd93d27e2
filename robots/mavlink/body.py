"""Body of a rover behind MAVLink: ArduRover in GUIDED, PX4 in OFFBOARD.

It connects, checks, arms and sets the mode before the run begins, and stops and disarms at its end.
Its time is the monotonic clock of this computer since then; the rover's stamps are converted to it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from time import monotonic, sleep  # noqa: TID251 - a real robot's clock
from typing import Any

from robots.mavlink.checks import LAST, OLDEST_ODOMETRY, Check, Subject, checks_of
from robots.mavlink.estimates import OLDEST, SentEstimate
from robots.mavlink.loop_link import LoopLink
from robots.mavlink.measurements import Measurements
from robots.mavlink.parameters import MavlinkParameters
from robots.mavlink.rover_link import Phase
from robots.real_time import RealTimeBody
from robots.sensor_drivers.readers import SensorReaders
from stack.body import (
    AcceptsEstimate,
    BodyCommand,
    BodyHealth,
    Engageable,
    FastLoopBody,
    LinkedBody,
)
from stack.drivetrain.description import RobotDescription
from stack.errors import BodyError, InputError
from stack.mavlink.signing import read_key
from stack.types import (
    STANDSTILL,
    Imu,
    LoopStatistics,
    Measurement,
    Observation,
    Odometry,
    Pose2D,
    PoseEstimate,
    has_jumped,
)

POLL = 0.05
"""Seconds between two looks while the body waits for the rover."""

SETTLE = 1.5
"""Seconds after the rover was found within which others on the link are noticed."""

STOOD_FOR = 1.0
"""Seconds of standstill orders after which small measured velocities are noise."""


class MavlinkBody(RealTimeBody, FastLoopBody, LinkedBody, Engageable, AcceptsEstimate):
    """Drives a rover.

    Args:
        description: of the robot.
        parameters: of the body.
        start: pose at which the rover stands, map frame.
        tell: writes a line for people: the autopilot's own texts, and the checks.
        interrupted: whether the user has given up waiting.

    Raises:
        InputError: the robot cannot be driven over MAVLink, a parameter does not fit it, or the key
            cannot be read.
        BodyError: there is no rover, or it may not drive; names the check that failed.
    """

    def __init__(
        self, description: RobotDescription, parameters: MavlinkParameters, *,
        start: Pose2D = Pose2D(0.0, 0.0), tell: Callable[[str], None] = lambda line: None,
        interrupted: Callable[[], bool] = lambda: False,
    ) -> None:  # fmt: skip
        _check_fit(description, parameters)
        if parameters.key:
            parameters = replace(parameters, key=str(_readable_key(description, parameters.key)))
        super().__init__(description)
        self._parameters, self._tell = parameters, tell
        self._interrupted = interrupted
        self._measurements = Measurements(
            description, parameters.odometry, parameters.obstacle_distance, parameters.rangefinders
        )
        self._asked, self._stood_since = False, monotonic()
        self._found_at = self._received_at = monotonic()
        self._seen: dict[str, float] = {}
        self.checks: list[Check] = []
        self._last: PoseEstimate | None = None
        self._resets = 0
        self._sensors = SensorReaders(description)
        self._link = LoopLink(description, parameters)
        try:
            if parameters.estimate != "none":
                self._link.tell_estimate(SentEstimate((start.x, start.y, start.heading)))
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
        self._found_at = monotonic()
        self._wait(lambda: bool(self._link.heard.others), SETTLE)
        self._refuse_failures(("one rover", "signature"))

    def _take_control(self) -> None:
        """Wait until all checks pass; ask for the mode and to be armed once the others do.

        Raises:
            BodyError: a check still fails after the time limit.
        """

        def ready() -> bool:
            failed = [check.name for check in self._checked() if not check.passed]
            if not self._asked and all(name in LAST for name in failed):
                self._asked = True
                self._link.engage()
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
            self._link.drive(STANDSTILL)
            self._receive()
            sleep(POLL)

    def _checked(self) -> list[Check]:
        now = monotonic()
        subject = Subject(
            self._link.heard, self._link.problem, self._measurements, self._parameters, now,
            now - self._found_at,
        )  # fmt: skip
        self.checks = checks_of(subject)
        return self.checks

    def _refuse_failures(self, names: tuple[str, ...]) -> None:
        failed = [str(c) for c in self._checked() if not c.passed and c.name in names]
        if failed:
            raise BodyError(f"the rover may not drive: {'; '.join(failed)}")

    # The run.

    @property
    def loop_statistics(self) -> LoopStatistics:
        """Timing of the process that holds the link."""
        return self._link.statistics

    @property
    def link_figures(self) -> Mapping[str, Any]:
        """Latency and rates of the link."""
        return self._link.figures(monotonic() - self._found_at)

    @property
    def health(self) -> BodyHealth:
        """Why the rover does not obey or measure; empty if it does."""
        problem = self._link.problem
        if problem:
            return BodyHealth(problem, self._link.fault)
        heard = self._measurements.odometry.heard
        if heard is not None and self._received_at - heard > OLDEST_ODOMETRY:
            return BodyHealth(f"no odometry from the rover: no {self._measurements.source}")
        return BodyHealth(self._sensors.problem)

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
        found |= self._sensors.take(self._began, now)
        odometry = self._measurements.odometry
        odometry.stands = now - self._stood_since > STOOD_FOR
        found["wheels"] = replace(odometry.at(now), stamp=time)
        return Observation(time, found)

    def command(self, command: BodyCommand) -> None:
        """Drive a velocity until the next command, at most DEAD_MAN seconds."""
        twist = self._description.drivetrain.feasible(command.twist)
        if twist != STANDSTILL:
            self._stood_since = monotonic()
        self._link.drive(twist, emergency_stop=command.emergency_stop)

    def _receive(self) -> None:
        self._received_at = monotonic()
        for item in self._link.take():
            self._measurements.add(item)
        for text in self._link.heard.take_texts():
            self._tell(f"autopilot: {text}")

    def engage(self) -> str:
        """Ask for the mode and to be armed again; a rover that is not heard cannot be asked."""
        if self._link.phase in (Phase.SEARCHING, Phase.LOST):
            return self._link.problem
        if self._link.phase not in (Phase.DRIVING, Phase.ENGAGING):
            self._link.engage()
        return ""

    def accept_estimate(self, estimate: PoseEstimate, motion: Odometry) -> None:
        """Send the pose to the rover, if it shall know it; a lost robot has none."""
        if self._parameters.estimate == "none":
            return
        if self._last is not None and has_jumped(self._last, estimate):
            self._resets = (self._resets + 1) % 256
        self._last = estimate
        if not estimate.is_lost:
            pose, twist, (a, b, c) = estimate.pose, motion.twist, estimate.covariance.tolist()
            self._link.tell_estimate(
                SentEstimate(
                    (pose.x, pose.y, pose.heading), (tuple(a), tuple(b), tuple(c)),
                    (twist.linear, twist.lateral, twist.angular), self._resets,
                    monotonic() + OLDEST,
                )
            )  # fmt: skip

    def close(self) -> None:
        """Stop and disarm the rover, and disconnect. Safe to call twice."""
        self._link.close()
        self._sensors.close()


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


def _readable_key(robot: RobotDescription, name: str) -> Path:
    """Return the absolute path of a key; a relative one is beside the robot file.

    Raises:
        InputError: it cannot be read, others can read it, or it holds no key.
    """
    beside = Path() if robot.source is None else robot.source.parent
    path = (beside / Path(name).expanduser()).absolute()
    read_key(path)
    return path


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
