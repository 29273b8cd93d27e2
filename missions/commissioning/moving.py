"""Preflight checks with a little motion: signs of wheels, gyro and mounts, and the stops."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import degrees

import numpy as np

from missions.commissioning.checks import Check, failed, judged, passed, skipped
from missions.commissioning.standing import nearest_obstacle
from missions.commissioning.watching import Watched, watch
from stack.body import DEAD_MAN, Body, BodyCommand
from stack.drivetrain.description import RobotDescription
from stack.errors import BodyError
from stack.mapping.slam.matching.local_map import align_pair
from stack.mapping.slam.matching.scans import prepare
from stack.perception.own_body import OwnBody
from stack.types import (
    STANDSTILL,
    FloatArray,
    Imu,
    Observation,
    Odometry,
    Pose2D,
    Scan,
    Twist,
)

FREE = 0.3
"""Metres around the outline that the motion needs."""

TURN_SPEED, TURN_TIME = 0.4, 2.0
"""rad/s and s: 45 deg to the left."""

DRIVE_SPEED, DRIVE_TIME = 0.12, 1.5
"""m/s and s: 18 cm forward."""

SETTLING = 1.0
"""Seconds for which the robot stands before and after a motion."""

AGREEMENT = 0.35
"""Relative difference of two sensors' motion that passes: an uncalibrated robot has 20 %."""

ASIDE = 20.0
"""Degrees between the motion by a lidar and straight on that pass; `calibrate lidar` is finer."""

COMMANDED = 0.6
"""Relative difference from the commanded motion that passes: a robot takes time to get going."""

LEAST_SHARE = 0.4
"""Of the points of a scan that a match explains."""

STOPS_WITHIN, STANDING = 1.2, 0.02
"""Seconds after its last command in which a robot stands (0.3 s and its deceleration), and the
speed below which it does, m/s and rad/s."""

LONGEST_RANGE = 30.0
"""Metres; longer ranges are not matched."""

ESTOP_TIME = 20.0
"""Seconds for which a pressed emergency stop is waited for."""


def check_moving(
    body: Body, confirms: Callable[[str], bool], *, estop: bool = False
) -> Iterator[Check]:
    """Move the robot a little; yield each check.

    Args:
        body: the robot, whose checks at standstill have passed.
        confirms: asks the operator before anything moves; False leaves the motion out.
        estop: whether the operator presses the emergency stop for a test.
    """
    robot = body.description
    try:
        space = _check_space(body)
        yield space
        if space.outcome == "failed":
            yield skipped("motion", "there is no room for it")
            return
        if not confirms(
            f"{robot.name} will turn left by {degrees(TURN_SPEED * TURN_TIME):.0f} deg and drive "
            f"{100 * DRIVE_SPEED * DRIVE_TIME:.0f} cm forward. Is the floor free?"
        ):
            yield skipped("motion", "not confirmed")
            return
        yield from _check_turn(body)
        yield from _check_drive(body)
        yield _check_dead_man(body)
        if estop:
            yield _check_estop(body, confirms)
    except BodyError as error:
        yield failed("motion", str(error), "see the manual of the robot")
    finally:
        body.command(BodyCommand(STANDSTILL))


def _check_space(body: Body) -> Check:
    distance = nearest_obstacle(watch(body, 0.5), body.description)
    if distance is None:
        return skipped("free space", "the robot has no lidar that sees anything")
    return judged(
        "free space", distance >= FREE, f"{distance:.2f} m around the outline, needed {FREE:g} m",
        "clear the floor around the robot, or leave the motion out: --no-motion",
    )  # fmt: skip


def _check_turn(body: Body) -> Iterator[Check]:
    """Turn left; a car drives a left arc."""
    robot = body.description
    twist = Twist(0.0, TURN_SPEED)
    if not robot.drivetrain.turns_in_place:
        twist = Twist(DRIVE_SPEED, DRIVE_SPEED / (1.3 * robot.turning_radius))
    seen, pairs = _motion(body, twist, TURN_TIME)
    wheels = _by_wheels(seen).heading
    wanted = twist.angular * TURN_TIME
    remedy = "swap the sides of the wheels or the signs of the encoders: left is positive"
    check = _compared("turn: wheels", wheels, wanted, "commanded", "deg", remedy)
    yield check
    expected, by = _expected(check, wheels, wanted)
    gyro = _by_gyro(seen, robot)
    if gyro is not None:
        remedy = "turn the IMU's axes in its driver: z points up, a turn to the left is positive"
        yield _compared("turn: imu", gyro, expected, by, "deg", remedy)
    for name, moved in _by_scans(pairs, robot).items():
        remedy = f"turn the angles of {name} the other way: is it upside down (`roll: 180 deg`)?"
        yield _compared(f"turn: {name}", _turned(moved), expected, by, "deg", remedy)


def _check_drive(body: Body) -> Iterator[Check]:
    robot = body.description
    seen, pairs = _motion(body, Twist(DRIVE_SPEED), DRIVE_TIME)
    wheels = _by_wheels(seen).x
    wanted = DRIVE_SPEED * DRIVE_TIME
    remedy = "swap the signs of the wheels' commands and encoders: forward is positive"
    check = _compared("forward: wheels", wheels, wanted, "commanded", "m", remedy)
    yield check
    expected, by = _expected(check, wheels, wanted)
    for name, moved in _by_scans(pairs, robot).items():
        aside = 0.0 if moved is None else degrees(np.arctan2(moved.y, moved.x))
        if moved is not None and abs(aside) > ASIDE and np.hypot(moved.x, moved.y) > 0.03:
            yield failed(
                f"forward: {name}",
                f"{np.hypot(moved.x, moved.y):.2f} m towards {aside:.0f} deg, {by} forward",
                f"correct `yaw` of {name} in the robot file by {-aside:+.0f} deg",
            )
            continue
        along = None if moved is None else moved.x
        yield _compared(f"forward: {name}", along, expected, by, "m", "calibrate the odometry")


def _expected(check: Check, wheels: float, wanted: float) -> tuple[float, str]:
    """Return the motion with which gyro and lidars are compared: of wheels that are right."""
    return (wheels, "by the wheels") if check.outcome == "passed" else (wanted, "commanded")


def _compared(  # noqa: PLR0913 - two motions, and words about them
    name: str, found: float | None, expected: float, by: str, unit: str, remedy: str
) -> Check:
    """Return the check of a motion against another one, in sign and size."""
    if found is None:
        hint = "stand nearer to walls or furniture"
        return failed(name, "its scans before and after do not match", hint)
    factor = degrees(1.0) if unit == "deg" else 1.0
    digits = 0 if unit == "deg" else 2
    sentence = f"{factor * found:+.{digits}f} {unit}, {by} {factor * expected:+.{digits}f} {unit}"
    if abs(expected) < 0.03:
        return failed(name, f"{sentence}: too little to compare", "is the drive enabled?")
    limit = COMMANDED if by == "commanded" else AGREEMENT
    return judged(name, abs(found / expected - 1.0) <= limit, sentence, remedy)


def _motion(
    body: Body, twist: Twist, seconds: float
) -> tuple[Watched, dict[str, tuple[Scan, Scan]]]:
    """Move; return what was measured, and of each lidar a scan before and one after."""
    before = watch(body, SETTLING)
    during = watch(body, seconds, twist)
    after = watch(body, SETTLING)
    own = OwnBody(body.description)
    pairs = {}
    for name in body.description.real_lidars:
        first = [scan for o in before.observations for scan in _scans(own.removed(o), name)]
        last = [scan for o in after.observations for scan in _scans(own.removed(o), name)]
        if first and last:
            pairs[name] = first[-1], last[-1]
    return Watched(before.observations + during.observations + after.observations), pairs


def _scans(observation: Observation, name: str) -> list[Scan]:
    scan = observation.named(name, Scan)
    return [] if scan is None else [scan]


def _by_wheels(seen: Watched) -> Pose2D:
    poses = [reading.pose for _, reading in seen.of("wheels", Odometry)]
    return poses[-1].relative_to(poses[0]) if poses else Pose2D(0.0, 0.0)


def _by_gyro(seen: Watched, robot: RobotDescription) -> float | None:
    """Return the rotation by the gyro, radians, without its mean rate in the first second."""
    if robot.imu is None:
        return None
    samples = [imu for _, imu in seen.of("imu", Imu)]
    if not samples:
        return None
    stamps = np.concatenate([imu.stamps for imu in samples])
    rates: FloatArray = np.concatenate([imu.angular_velocity[:, 2] for imu in samples])
    bias = float(rates[stamps < stamps[0] + SETTLING].mean())
    return float(np.trapezoid(rates - bias, stamps))


def _by_scans(
    pairs: dict[str, tuple[Scan, Scan]], robot: RobotDescription
) -> dict[str, Pose2D | None]:
    """Return the motion of the base by each lidar, from scans at standstill; None: no match.

    The alignment begins at the poses of several turns and steps, and not at odometry.
    """
    found: dict[str, Pose2D | None] = {}
    for name, (first, last) in pairs.items():
        noise = robot.range_noise(name)
        fixed, moved = (prepare(scan, LONGEST_RANGE, noise) for scan in (first, last))
        starts = [
            Pose2D(0.0, 0.0, turn).compose(Pose2D(step * np.cos(way), step * np.sin(way)))
            for turn in np.linspace(-1.2, 1.2, 13)
            for step, way in ((0.0, 0.0), *((0.18, way) for way in np.linspace(0, 5.5, 8)))
        ]
        matches = [align_pair(fixed, moved, start) for start in starts]
        best = max(matches, key=lambda match: match.overlap)
        found[name] = best.pose if best.overlap > LEAST_SHARE else None
    return found


def _turned(moved: Pose2D | None) -> float | None:
    return None if moved is None else moved.heading


def _check_dead_man(body: Body) -> Check:
    """Let the robot creep forward, then command nothing: it must stop by itself."""
    watch(body, 0.6, Twist(DRIVE_SPEED))
    end = body.time + STOPS_WITHIN
    while body.time < end:
        body.sense()
        body.wait(0.02)
    twist = next(iter(body.sense().of(Odometry).values())).twist
    speed = max(abs(twist.linear), abs(twist.angular))
    return judged(
        "stop without commands", speed <= STANDING,
        f"{speed:.2f} m/s {STOPS_WITHIN:g} s after the last command",
        f"set the command timeout of the motor controller to {DEAD_MAN:g} s",
    )  # fmt: skip


def _check_estop(body: Body, confirms: Callable[[str], bool]) -> Check:
    """Wait until the operator presses the emergency stop: the body must report a problem."""
    question = f"Press the emergency stop within {ESTOP_TIME:g} s after your answer. Ready?"
    if not confirms(question):
        return skipped("emergency stop", "not confirmed")
    end = body.time + ESTOP_TIME
    while body.time < end:
        watch(body, 0.2)
        problem = body.health.problem
        if problem:
            return passed("emergency stop", problem)
    return failed(
        "emergency stop", f"the robot reported nothing in {ESTOP_TIME:g} s",
        "connect the emergency stop's contact to the robot's status",
    )  # fmt: skip
