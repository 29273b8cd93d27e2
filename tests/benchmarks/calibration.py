"""How well `treepilot calibrate` finds what is wrong with a simulated robot.

    python -m tests.benchmarks.calibration odometry scout --seeds 20
    python -m tests.benchmarks.calibration lidar jackal --seeds 20

For each seed the simulated robot differs from its description: radii by 5 % and track by 3 %, to
either side, or the mount of its lidar by up to 5 cm along each axis and 4 deg. The lidar, or wheels
and gyro for its mount, is the only reference; the truth is only compared with the result.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from missions.commissioning.lidar_fit import fit_mount
from missions.commissioning.odometry import DriveLimits, drive_and_fit, prepared
from missions.execution.resources import load_robot, load_world
from robots.simulated import SimulatedBody
from stack.drivetrain.description import RobotDescription
from stack.streams import stream
from stack.types import Pose2D

HERE = Path(__file__).parent

RADIUS_ERROR, DIFFERENCE, TURNING_ERROR = 0.05, 0.2, 0.03
"""Relative errors of the radii and of the track; the second wheel's error is smaller by 20 %."""


@dataclass(frozen=True)
class Trial:
    """Relative errors of the lengths before and after a calibration, as the last is stated."""

    seed: int
    labels: tuple[str, ...]
    before: tuple[float, ...]
    after: tuple[float, ...]
    stated: tuple[float, ...]
    seconds: float

    @property
    def worst(self) -> float:
        """Largest relative error of a length after it."""
        return max(map(abs, self.after))


def wrongly_described(actual: RobotDescription, seed: int) -> RobotDescription:
    """A description with wrong wheels of a robot that is simulated as it is."""
    random = stream(seed, "wrong description")
    radius, turning = (
        error * random.choice([-1.0, 1.0]) for error in (RADIUS_ERROR, TURNING_ERROR)
    )
    radii = [r * (1.0 + radius) for r in actual.drivetrain.radii]
    if not actual.drivetrain.steering_joints:  # both wheels of a car are one length
        radii[-1] = actual.drivetrain.radii[-1] * (1.0 + (1.0 - DIFFERENCE) * radius)
    wheels = actual.wheels.calibrated(radii, actual.wheels.turning_length * (1.0 + turning))
    return replace(actual, wheels=wheels, actual=actual)


def odometry_trial(name: str, seed: int, limits: DriveLimits, slip: float | None = None) -> Trial:
    """Calibrate the odometry of a simulated robot.

    Args:
        name: of the robot.
        seed: of its errors and of the simulation.
        limits: of the drive.
        slip: of the wheels; None: that of the robot file.
    """
    actual = load_robot(name, HERE)
    # without a scale error drawn besides: the true lengths are then known
    odometry = replace(actual.odometry, scale_error=0.0)
    odometry = odometry if slip is None else replace(odometry, slip=slip)
    actual = replace(actual, odometry=odometry, sonars={}, camera=None, depth_cameras={})
    world = load_world("test_floor", HERE)
    described = wrongly_described(actual, seed)
    body = SimulatedBody(described, world, start=world.start, seed=seed)
    try:
        fit = drive_and_fit(*prepared(body), limits, lambda _: None)
        assert body.tally.by_robot == 0
        seconds = body.time
    finally:
        body.close()
    lengths = [estimate for estimate in fit.estimates if estimate.unit == "m"]
    true = np.array([*actual.drivetrain.radii, true_turning_length(actual, seed)])[-len(lengths) :]
    return Trial(
        seed, tuple(e.label for e in lengths),
        tuple(e.before / t - 1.0 for e, t in zip(lengths, true, strict=True)),
        tuple(e.value / t - 1.0 for e, t in zip(lengths, true, strict=True)),
        tuple(e.deviation / e.value for e in lengths), seconds,
    )  # fmt: skip


def lidar_trial(name: str, seed: int, limits: DriveLimits, slip: float | None = None) -> Trial:
    """Calibrate the mount of the lidar of a simulated robot: x, y in metres, yaw in radians."""
    actual = load_robot(name, HERE)
    odometry = replace(actual.odometry, scale_error=0.0)
    odometry = odometry if slip is None else replace(odometry, slip=slip)
    actual = replace(actual, odometry=odometry, sonars={}, camera=None, depth_cameras={})
    lidar = actual.lidar
    assert lidar is not None
    off = stream(seed, "wrong mount").uniform(-1.0, 1.0, 3) * (0.05, 0.05, np.radians(4.0))
    true = np.array([lidar.mount.x, lidar.mount.y, lidar.mount.heading])
    described = replace(lidar, mount=Pose2D(*(true + off).tolist()))
    world = load_world("test_floor", HERE)
    body = SimulatedBody(
        replace(actual, lidar=described, actual=actual), world, start=world.start, seed=seed
    )
    try:
        driver, pattern = prepared(body)
        drive_and_fit(driver, pattern, limits, lambda _: None)
        seconds = body.time
    finally:
        body.close()
    fit = fit_mount(driver.observations, body.description, "lidar")
    found = np.array([fit.mount.x, fit.mount.y, fit.mount.heading])
    return Trial(
        seed, ("x", "y", "yaw"), tuple(off.tolist()), tuple((found - true).tolist()),
        tuple(fit.deviations.tolist()), seconds,
    )  # fmt: skip


def true_turning_length(actual: RobotDescription, seed: int) -> float:
    """The length by which turns are divided; of wheels that skid, on the floor of this seed."""
    if not actual.drivetrain.skids:
        return actual.wheels.turning_length
    skid = actual.skid
    draw = float(stream(seed, "skid floor", 0).standard_normal())
    return actual.drivetrain.track * skid.icr_ratio * (1.0 + skid.floor_variation * draw)


def main() -> None:
    """Print a line for each seed, then root mean square and largest error of each length."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=["odometry", "lidar"])
    parser.add_argument("robot")
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--precision", type=float, default=0.0012)
    parser.add_argument("--longest", type=float, default=1500.0)
    parser.add_argument("--slip", type=float)
    given = parser.parse_args()
    limits, trials = DriveLimits(given.precision, given.longest), []
    trial_of = odometry_trial if given.what == "odometry" else lidar_trial
    factors = np.array([100.0] * 4 if given.what == "odometry" else [1000.0, 1000.0, 180.0 / np.pi])
    for seed in range(given.first, given.first + given.seeds):
        trial = trial_of(given.robot, seed, limits, given.slip)
        trials.append(trial)
        errors = "  ".join(
            f"{label} {factor * before:+.1f} -> {factor * after:+.3f} (± {factor * stated:.3f})"
            for label, factor, before, after, stated in zip(
                trial.labels, factors, trial.before, trial.after, trial.stated, strict=False
            )
        )
        print(f"seed {seed}, {trial.seconds:.0f} s: {errors}", flush=True)
    after = np.array([trial.after for trial in trials])
    after = factors[: after.shape[1]] * after
    rms, largest = np.sqrt((after**2).mean(axis=0)), np.abs(after).max(axis=0)
    unit = "%" if given.what == "odometry" else "mm, mm, deg"
    print(f"rms {rms.round(3)}, largest {largest.round(3)} {unit}")


if __name__ == "__main__":
    main()
