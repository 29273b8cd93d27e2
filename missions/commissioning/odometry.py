"""Calibration of odometry: drives until the lengths are known, or reads a recorded drive."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from missions.commissioning.driver import Driver
from missions.commissioning.odometry_fit import OdometryFit, fit_odometry
from missions.commissioning.programme import SETTLING, rounds
from missions.commissioning.recording import Drive, gyro_of, read_drive, reference_track, wheels_of
from missions.commissioning.reference import Reference
from missions.commissioning.space import Pattern, pattern_in
from stack.body import Body
from stack.drivetrain.description import RobotDescription
from stack.errors import InputError
from stack.types import Observation


@dataclass(frozen=True, slots=True)
class DriveLimits:
    """How long a calibration drives.

    Attributes:
        precision: relative standard deviation of the lengths that ends the drive.
        longest: seconds after which it ends anyway.
    """

    precision: float = 0.003
    longest: float = 900.0


@dataclass(frozen=True, slots=True)
class Round:
    """State of a calibration after a round of its drive."""

    number: int
    seconds: float
    fit: OdometryFit


def prepared(body: Body, lidar: str = "") -> tuple[Driver, Pattern]:
    """Let the robot stand, and choose the pattern for its free space.

    Raises:
        InputError: the robot has no lidar, or too little free space.
        BodyError: the robot does not respond.
    """
    robot = body.description
    name = lidar or robot.main_lidar
    if name not in robot.real_lidars:
        known = ", ".join(robot.real_lidars) or "none"
        raise InputError(
            f"{robot.name} has no lidar {name!r}; available: {known}",
            "the lidar is the reference of a calibration",
        )
    driver = Driver(body, Reference(robot, name))
    driver.stand(SETTLING)
    if driver.reference.points is None:
        raise InputError(f"{name} delivers no scans", f"run `treepilot preflight {robot.name}`")
    return driver, pattern_in(driver.reference.points, robot)


def drive_and_fit(
    driver: Driver, pattern: Pattern, limits: DriveLimits, tell: Callable[[Round], None]
) -> OdometryFit:
    """Drive rounds until the lengths are precise, or for the longest time.

    Args:
        driver: whose robot stands.
        pattern: that is driven.
        limits: of the drive.
        tell: called after each round.

    Raises:
        BodyError: the robot does not respond, or is blocked.
    """
    for number, _ in enumerate(rounds(driver, pattern), 1):
        driver.reference.keep_map()
        fit = fit_odometry(driven(driver))
        tell(Round(number, driver.body.time, fit))
        if fit.worst <= limits.precision or driver.body.time >= limits.longest:
            return fit
    raise AssertionError("rounds do not end")


def driven(driver: Driver) -> Drive:
    """Return what a driver has recorded so far."""
    robot, seen = driver.body.description, driver.observations
    track = reference_track(driver.reference, robot.main_lidar)
    return Drive(robot, wheels_of(seen), gyro_of(seen), track)


def fit_recorded(
    observations: Iterable[Observation], robot: RobotDescription, lidar: str = ""
) -> OdometryFit:
    """Fit a recorded drive.

    Raises:
        InputError: it has no scans, wheels, or not enough of them.
    """
    return fit_odometry(read_drive(observations, robot, lidar))
