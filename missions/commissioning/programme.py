"""The calibration drive: squares both ways, straight lines, turns in place; circles for a car."""

from __future__ import annotations

from collections.abc import Iterator
from math import atan2, cos, sin

from missions.commissioning.driver import Driver, full_turns
from missions.commissioning.space import Pattern

SETTLING = 3.0
"""Seconds of standstill at the beginning: the gyro's offset."""

SPINS = 5
"""Full turns in place after each square."""


def rounds(driver: Driver, pattern: Pattern) -> Iterator[None]:
    """Drive the pattern again and again; yield after each round, with the robot standing.

    Args:
        driver: of the robot, which has stood since its first step.
        pattern: which fits into the free space.

    Raises:
        BodyError: the robot does not respond, or is blocked.
    """
    robot = driver.body.description
    while True:
        if not robot.drivetrain.turns_in_place:
            _car_round(driver, pattern)
        else:
            _square(driver, pattern, 1)
            driver.turn(full_turns(SPINS))
            _square(driver, pattern, -1)
            driver.turn(-full_turns(SPINS))
            if robot.drivetrain.can_move_sideways:
                _sideways_square(driver, pattern)
        yield


def _corners(pattern: Pattern, way: int) -> list[tuple[float, float]]:
    """Return the corners of the square in the order of a round, anticlockwise for 1."""
    half = pattern.side / 2.0
    plain = [(-half, -half), (half, -half), (half, half), (-half, half), (-half, -half)]
    c, s = cos(pattern.direction), sin(pattern.direction)
    return [(c * x - s * y, s * x + c * y) for x, y in plain[::way]]


def _square(driver: Driver, pattern: Pattern, way: int) -> None:
    before = None
    for corner in _corners(pattern, way):
        x, y = corner
        start = (driver.pose.x, driver.pose.y) if before is None else before
        heading = atan2(y - start[1], x - start[0])
        if (x - start[0]) ** 2 + (y - start[1]) ** 2 > 0.01:
            driver.turn_to(heading)
            driver.drive_to(x, y, heading)
        before = corner


def _sideways_square(driver: Driver, pattern: Pattern) -> None:
    for x, y in (*_corners(pattern, 1), *_corners(pattern, -1)):
        driver.move_to(x, y)


def _car_round(driver: Driver, pattern: Pattern) -> None:
    """A full circle to each side, and a straight line forward and back."""
    radius, direction = pattern.side, pattern.direction
    c, s = cos(direction), sin(direction)
    for side in (1.0, -1.0):
        driver.circle(radius, side * full_turns(1))
    for along in (radius, -radius, 0.0):
        driver.drive_to(c * along, s * along, direction)
