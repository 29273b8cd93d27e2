"""Preflight checks for which the robot does not move."""

from __future__ import annotations

from collections.abc import Iterator
from math import degrees

import numpy as np

from missions.commissioning.checks import Check, failed, judged, passed, skipped
from missions.commissioning.watching import PERIOD, Watched, watch
from stack.body import Body
from stack.drivetrain.description import RobotDescription
from stack.errors import BodyError
from stack.geometry.polygons import distances_to_edges
from stack.perception.own_body import OwnBody
from stack.types import Battery, FloatArray, Imu, Odometry, Scan

WATCHED = 3.0
"""Seconds that the robot is watched: 30 scans of a usual lidar."""

WARMING = 0.5
"""Seconds before, in which drivers deliver what they had queued."""

SLOW, FAST = 0.75, 1.5
"""Shares of the described rate between which a sensor's own rate may be."""

AHEAD, LATE = 0.02, 0.2
"""Seconds by which a stamp may be ahead of the robot's clock, and older than is explained."""

DRIFT = 0.05
"""Largest relative error of a sensor's clock; in 3 s jitter hides smaller ones."""

LEAST_CHARGE = 0.2
"""A robot with less does not start a mission."""

GRAVITY, GRAVITY_ERROR = 9.81, 1.5
"""Of the accelerometer at rest, m/s²; a tilt of 25 deg changes it by 0.9."""

STILL = 0.01
"""m/s and rad/s that the wheels of a standing robot may report."""

LEAST_VALID, LEAST_RETURNS = 0.3, 0.05
"""Shares of the beams that are valid, and that see something within the range."""

VIEW_ERROR = 3.0
"""Degrees between the field of view of a scan and that of the robot file."""

BIAS_DEVIATIONS = 5.0
"""Largest mean rate of a gyro at rest, in deviations of the described bias."""


def check_standing(body: Body, *, pictures: bool = False) -> Iterator[Check]:
    """Watch the robot at standstill; yield each check.

    Args:
        body: the robot.
        pictures: whether cameras are asked for pictures and checked too.
    """
    try:
        watch(body, WARMING, pictures=pictures)
        seen = watch(body, WATCHED, pictures=pictures)
    except BodyError as error:
        yield failed("hardware", str(error), "switch the robot on, check its cables and address")
        return
    problem = body.health.problem
    yield judged(
        "hardware", not problem, problem or "the robot answers", "see the manual of the robot"
    )
    robot = body.description
    for name, expected in _rates(robot, pictures=pictures).items():
        yield from _check_delivery(seen, name, expected, _latency(robot, name))
    for name in robot.real_lidars:
        yield from _check_scans(seen, robot, name)
    yield from _check_wheels(seen)
    if robot.imu is not None:
        yield from _check_imu(seen, robot)
    yield _check_battery(seen)


def _rates(robot: RobotDescription, *, pictures: bool) -> dict[str, float]:
    """Return the described rate of each sensor by name, Hz; 0: as often as the robot likes."""
    rates = {name: lidar.rate for name, lidar in robot.real_lidars.items()}
    rates |= {name: sonar.rate for name, sonar in robot.sonars.items()}
    if robot.imu is not None:
        rates["imu"] = robot.imu.rate
    if pictures:
        rates |= {name: camera.rate for name, camera in robot.depth_cameras.items()}
        if robot.camera is not None:
            rates["camera"] = robot.camera.rate
    return rates | {"wheels": 0.0}


def _latency(robot: RobotDescription, name: str) -> float:
    """Return the described time from a measurement's stamp to its delivery, seconds."""
    if name in robot.real_lidars:
        return robot.real_lidars[name].rotation_time
    if name in robot.depth_cameras:
        return robot.depth_cameras[name].latency
    return robot.camera.latency if name == "camera" and robot.camera is not None else 0.0


def _check_delivery(seen: Watched, name: str, expected: float, latency: float) -> Iterator[Check]:
    """Check the rate of a sensor and its clock."""
    stamps = np.array(seen.stamps(name)).reshape(-1, 2)
    if not len(stamps):
        remedy = (
            f"check power and cable of {name}, and its driver; or remove it from the robot file"
        )
        yield failed(f"{name} rate", f"silent for {seen.seconds:.1f} s", remedy)
        return
    rate = len(stamps) / max(seen.seconds, PERIOD)
    found = f"{rate:.1f} Hz"
    if expected:
        # Of a lidar or sonar that is faster only the newest measurement of a step is seen.
        wanted = expected if name == "imu" else min(expected, 1.0 / PERIOD)
        yield judged(
            f"{name} rate", SLOW * wanted <= rate <= FAST * wanted,
            f"{found}, described {expected:g} Hz",
            f"set the rate of {name} in its driver, or `rate` in the robot file",
        )  # fmt: skip
    else:
        yield passed(f"{name} rate", found)
    yield _check_clock(stamps, name, latency + (1.0 / expected if expected else 0.0))


def _check_clock(stamps: FloatArray, name: str, explained: float) -> Check:
    """Check the stamps of a sensor against the robot's clock.

    Args:
        stamps: (n, 2) time of receipt and stamp, seconds.
        name: of the sensor.
        explained: age of a measurement that its sensor explains, seconds.
    """
    check, ages = f"{name} clock", stamps[:, 0] - stamps[:, 1]
    remedy = f"synchronise the clock of {name} with the robot's (NTP or PTP), or stamp on receipt"
    received, stamped = stamps[-1] - stamps[0]
    youngest, oldest = float(ages.min()), float(ages.max())
    drift = stamped / received - 1.0 if received > 0.0 else 0.0
    found = f"{1000 * youngest:.0f} to {1000 * oldest:.0f} ms old"
    if received > 0.0 and stamped <= 0.0:
        return failed(check, f"the stamps stand still at {stamps[-1, 1]:.2f} s", remedy)
    if youngest < -AHEAD:
        return failed(check, f"stamps are {-1000 * youngest:.0f} ms in the future", remedy)
    if youngest > explained + LATE:
        sentence = f"{found}; {1000 * explained:.0f} ms are explained by rate and latency"
        return failed(check, sentence, remedy)
    if received > 1.0 and abs(drift) > DRIFT:
        return failed(
            check, f"runs {100 * abs(drift):.0f} % {'fast' if drift > 0 else 'slow'}", remedy
        )
    return passed(check, found)


def _check_scans(seen: Watched, robot: RobotDescription, name: str) -> Iterator[Check]:
    """Check what the scans of a lidar show."""
    scans = [scan for _, scan in seen.of(name, Scan)]
    if not scans:
        return
    scan, described = scans[-1], robot.real_lidars[name]
    view = degrees(abs(scan.angle_increment) * scan.ranges.size)
    wanted = degrees(described.angle_increment * described.beams)
    yield judged(
        f"{name} view", abs(view - wanted) <= VIEW_ERROR,
        f"{scan.ranges.size} beams over {view:.0f} deg, described {wanted:.0f} deg",
        f"set `field_of_view` of {name} in the robot file",
    )  # fmt: skip
    ranges = np.concatenate([scan.ranges for scan in scans])
    valid, returns = 1.0 - float(np.isnan(ranges).mean()), float(np.isfinite(ranges).mean())
    yield judged(
        f"{name} beams", valid >= LEAST_VALID and returns >= LEAST_RETURNS,
        f"{valid:.0%} valid, {returns:.0%} see something within {scan.range_max:g} m",
        f"uncover and clean {name}; in a wide hall stand nearer to a wall",
    )  # fmt: skip


def _check_wheels(seen: Watched) -> Iterator[Check]:
    """Check that the wheels report a standstill."""
    readings = [reading for _, reading in seen.of("wheels", Odometry)]
    if not readings:
        return
    speeds = [
        max(abs(reading.twist.linear), abs(reading.twist.lateral), abs(reading.twist.angular))
        for reading in readings
    ]
    moved = readings[-1].pose.relative_to(readings[0].pose)
    is_still = max(speeds) <= STILL and abs(moved.x) + abs(moved.y) + abs(moved.heading) <= STILL
    found = f"at most {max(speeds):.3f} m/s or rad/s while the robot stands"
    yield judged("wheels at rest", is_still, found, "check the encoders, and that nothing moves it")


def _check_imu(seen: Watched, robot: RobotDescription) -> Iterator[Check]:
    """Check the IMU at rest: bias and noise of the gyro, direction of gravity."""
    samples = [imu for _, imu in seen.of("imu", Imu)]
    if not samples or robot.imu is None:
        return
    rates = np.concatenate([imu.angular_velocity[:, 2] for imu in samples])
    force = np.concatenate([imu.linear_acceleration for imu in samples]).mean(axis=0)
    mean, noise = float(rates.mean()), float(rates.std())
    limit = BIAS_DEVIATIONS * max(robot.imu.gyro_bias, robot.imu.gyro_noise)
    yield judged(
        "imu at rest", abs(mean) <= limit,
        f"turns at {mean:+.4f} ± {noise:.4f} rad/s at standstill, limit {limit:.3f} rad/s",
        "let the robot stand still; calibrate the IMU's bias, or correct `gyro_bias`",
    )  # fmt: skip
    up = float(force[2])
    yield judged(
        "imu upright", abs(up - GRAVITY) <= GRAVITY_ERROR,
        f"gravity on z is {up:+.2f} m/s², expected {GRAVITY:+.2f}",
        "mount the IMU upright, or turn its axes in the driver: x forward, y left, z up",
    )  # fmt: skip


def _check_battery(seen: Watched) -> Check:
    readings = [reading for _, reading in seen.of("battery", Battery)]
    if not readings:
        return skipped("battery", "the robot does not measure it")
    last = readings[-1]
    found = f"{last.charge:.0%}, {last.voltage:.1f} V"
    return judged("battery", last.charge >= LEAST_CHARGE or last.charging, found,
                  f"charge it to at least {LEAST_CHARGE:.0%}")  # fmt: skip


def nearest_obstacle(seen: Watched, robot: RobotDescription) -> float | None:
    """Return the distance from the outline to what the newest scans show, metres.

    None without a lidar that sees anything. Only points outside the outline count.
    """
    own, distances = OwnBody(robot), []
    for observation in seen.observations[-25:]:
        for scan in own.removed(observation).of(Scan).values():
            points = scan.points()
            if len(points):
                distances.append(float(distances_to_edges(points, robot.footprint.points).min()))
    return min(distances[-2 * len(robot.real_lidars) :], default=None)
