"""Fit of wheel radii, track and gyro to a drive with a reference.

The displacements of the wheels under other radii and another track are linear in those as
described. Gauss-Newton with Huber's weights finds the lengths with which dead reckoning over each
segment agrees with the reference. Systematic errors of odometry and how squares driven both ways
show them: J. Borenstein and L. Feng, "Measurement and Correction of Systematic Odometry Errors in
Mobile Robots" (UMBmark), IEEE Trans. Robotics and Automation 12(6), 1996.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from missions.commissioning.recording import Drive
from missions.commissioning.segments import Segments, segments_of
from stack.drivetrain.description import RobotDescription
from stack.drivetrain.drivetrain import Drivetrain, WheelGeometry
from stack.errors import InputError
from stack.types import FloatArray

DETERMINED = 0.006
"""A length is determined if its relative standard deviation is smaller."""

LEAST_SEGMENTS = 12

ITERATIONS, STEP = 12, 1e-5

HUBER = 3.0
"""Residuals beyond so many deviations count less: pushes, people in the way, false matches."""

MEDIAN = 0.89
"""Of the root mean square of three normal numbers with the deviation 1."""

LEAST_SCALE = 0.25
"""Smallest factor of the described deviations: the reference is never better than that."""

WEAK = 0.5
"""Relative deviation of a length before any measurement."""

STRAIGHT = 0.25
"""rad/m; a segment that turns less is straight: a circle of 4 m."""

OFFSET_DETERMINED = 0.002
"""rad/s, of the gyro's offset."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """A fitted number.

    Attributes:
        key: where it belongs in robot.yaml: `wheels.effective_radii`…
        label: for people.
        unit: m, rad/s or nothing.
        before: value of the robot file.
        value: fitted.
        deviation: standard deviation of the value.
        is_determined: whether the drive determines it.
        missing: what to drive so that it is determined; empty if it is.
    """

    key: str
    label: str
    unit: str
    before: float
    value: float
    deviation: float
    is_determined: bool
    missing: str = ""


@dataclass(frozen=True, slots=True)
class OdometryFit:
    """Result of a calibration of odometry.

    Attributes:
        estimates: radii, the length by which turns are divided, scale and offset of the gyro.
        segments: number of segments compared.
        before: (3,) root mean square of forward, sideways (m) and heading (rad) residuals of a
            segment with the robot file's values.
        after: (3,) with the fitted ones.
        expected: (3,) by slip and by the reference's error.
        straight: metres driven without turning.
        turned: (2,) radians turned to the left and to the right.
        wheels: with the fitted lengths.
    """

    estimates: tuple[Estimate, ...]
    segments: int
    before: FloatArray
    after: FloatArray
    expected: FloatArray
    straight: float
    turned: FloatArray
    wheels: WheelGeometry

    @property
    def values(self) -> dict[Sequence[str], str]:
        """The determined values of the robot file as YAML, by path.

        The radii are written together: all of them, or none.
        """
        found: dict[Sequence[str], str] = {}
        lengths = [e for e in self.estimates if e.unit == "m"]
        if all(estimate.is_determined for estimate in lengths[:-1]):
            radii = ", ".join(_in_cm(radius) for radius in self.wheels.effective_radii)
            found["wheels", "effective_radii"] = f"[{radii}]"
        if lengths[-1].is_determined:
            found["wheels", self.wheels.turning_key] = _in_cm(self.wheels.turning_length)
        for estimate in self.estimates:
            if estimate.unit != "m" and estimate.is_determined:
                section, _, key = estimate.key.partition(".")
                unit = f" {estimate.unit}" if estimate.unit else ""
                found[section, key] = f"{estimate.value:.5f}{unit}"
        return found

    @property
    def worst(self) -> float:
        """Largest relative deviation of the lengths."""
        return max(e.deviation / e.value for e in self.estimates if e.unit == "m")


def fit_odometry(drive: Drive) -> OdometryFit:
    """Fit radii, track and gyro.

    Raises:
        InputError: the drive is too short.
    """
    segments = segments_of(drive)
    if len(segments.begins) < LEAST_SEGMENTS:
        raise InputError(
            f"the drive has {len(segments.begins)} usable segments, at least {LEAST_SEGMENTS} are "
            "needed: drive longer"
        )
    model = Model(drive.robot)
    factors, covariance = _solve(model, segments)
    straight, turned = amounts(segments)
    deviations = np.sqrt(np.diag(covariance))
    estimates = _lengths(model, factors, deviations, straight, turned)
    estimates += fit_gyro(drive, segments)
    ones = np.ones(model.count)
    covariances = np.array([np.linalg.inv(root.T @ root) for root in segments.roots])
    return OdometryFit(
        tuple(estimates), len(segments.begins),
        _rms(segments.residuals(model.correction(ones))),
        _rms(segments.residuals(model.correction(factors))),
        np.sqrt(np.diagonal(covariances, axis1=1, axis2=2).mean(axis=0)), straight, turned,
        model.wheels(factors),
    )  # fmt: skip


class Model:
    """How other radii and another track change the displacements that wheels report.

    The factors are those of each radius, then of the length by which turns are divided. A car has
    one factor for both rear wheels: its steering turns it, not their difference.

    Args:
        robot: as described during the drive.
    """

    def __init__(self, robot: RobotDescription) -> None:
        self._robot, self._wheels = robot, robot.wheels
        self._steers = bool(robot.drivetrain.steering_joints)
        self._radii = np.array(robot.drivetrain.radii)
        self._described = None if self._steers else _matrix(robot.drivetrain)
        self.count = 2 if self._steers else len(self._radii) + 1

    def correction(self, factors: FloatArray) -> FloatArray:
        """Return the (3, 3) matrix from displacements as described to those with the factors."""
        if self._described is None:
            radius, base = factors.tolist()
            scales: FloatArray = np.diag([radius, radius, radius / base])
            return scales
        drivetrain = self.wheels(factors).drivetrain(self._robot.limits)
        # the wheels' angles are measured: with other radii they have rolled other distances
        rolled = np.diag(factors[:-1]) @ np.linalg.pinv(self._described)
        correction: FloatArray = _matrix(drivetrain) @ rolled
        return correction

    def wheels(self, factors: FloatArray) -> WheelGeometry:
        """Return the wheels with the factors."""
        turning = self._wheels.turning_length * float(factors[-1])
        return self._wheels.calibrated((self._radii * factors[:-1]).tolist(), turning)

    @property
    def lengths(self) -> FloatArray:
        """(count,) the described lengths that the factors scale, metres."""
        radii = self._radii.mean(keepdims=True) if self._steers else self._radii
        return np.append(radii, self._wheels.turning_length)

    @property
    def labels(self) -> Sequence[str]:
        """What the factors scale."""
        turning = self._wheels.turning_key.replace("_", " ")
        if self._steers:
            return "rear radius", turning
        if len(self._radii) == 2:
            return "left radius", "right radius", turning
        return *(f"radius of {joint}" for joint in self._robot.drivetrain.driven_joints), turning


def _matrix(drivetrain: Drivetrain) -> FloatArray:
    """Return (3, n) displacement for one metre rolled by each wheel."""
    units = np.eye(drivetrain.encoders).tolist()
    still = [0.0] * drivetrain.encoders
    moved = [drivetrain.from_wheels(unit, still) for unit in units]
    return np.array([(pose.x, pose.y, pose.heading) for pose in moved]).T


def _solve(model: Model, segments: Segments) -> tuple[FloatArray, FloatArray]:
    """Return the factors with the least squared residuals, and their covariance."""
    factors = np.ones(model.count)

    def whitened(values: FloatArray) -> FloatArray:
        off = segments.residuals(model.correction(values))
        found: FloatArray = np.einsum("nij,nj->ni", segments.roots, off)
        return found

    weak = np.eye(model.count) / WEAK**2
    for _ in range(ITERATIONS):
        off = whitened(factors)
        slopes = np.stack([
            (whitened(factors + STEP * axis) - off) / STEP for axis in np.eye(model.count)
        ], axis=-1)  # fmt: skip
        sizes = np.linalg.norm(off, axis=1) / np.sqrt(3.0)
        scale = max(LEAST_SCALE, float(np.median(sizes)) / MEDIAN)
        weights = np.minimum(1.0, HUBER * scale / np.maximum(sizes, 1e-12))
        hessian = np.einsum("n,nij,nik->jk", weights, slopes, slopes) / scale**2 + weak
        gradient = np.einsum("n,nij,ni->j", weights, slopes, off) / scale**2
        change = -np.linalg.solve(hessian, gradient + weak @ (factors - 1.0))
        factors = factors + change
        if float(np.abs(change).max()) < 1e-8:
            break
    covariance: FloatArray = np.linalg.inv(hessian)
    return factors, covariance


def _lengths(
    model: Model, factors: FloatArray, deviations: FloatArray, straight: float, turned: FloatArray
) -> list[Estimate]:
    keys = ["wheels.effective_radii"] * (model.count - 1)
    keys.append(f"wheels.{model.wheels(factors).turning_key}")
    found = []
    for key, label, before, factor, deviation in zip(
        keys, model.labels, model.lengths.tolist(), factors.tolist(), deviations.tolist(),
        strict=True,
    ):  # fmt: skip
        relative = deviation / factor
        known = relative <= DETERMINED
        missing = "" if known else _missing(relative, straight, turned)
        found.append(
            Estimate(key, label, "m", before, before * factor, before * deviation, known, missing)
        )
    return found


def _missing(relative: float, straight: float, turned: FloatArray) -> str:
    """Return which drive is missing: that of which there is least, in deviations of its part."""
    turns = float(turned.sum()) / (2.0 * np.pi)
    if straight < 3.0:
        return f"straight drives: {straight:.1f} m so far"
    if float(turned.min()) < np.pi:
        return f"turns to both sides: {turns:.1f} turns so far"
    more = (relative / DETERMINED) ** 2
    return f"a longer drive: about {more:.0f} times {straight:.0f} m and {turns:.0f} turns"


def amounts(segments: Segments) -> tuple[float, FloatArray]:
    """Return the metres driven straight on, and (2,) the radians turned to the left and right."""
    lengths, turns = np.hypot(segments.moved[:, 0], segments.moved[:, 1]), segments.moved[:, 2]
    is_straight = np.abs(turns) < STRAIGHT * lengths
    left, right = turns.clip(min=0.0).sum(), -turns.clip(max=0.0).sum()
    return float(lengths[is_straight].sum()), np.array([left, right])


def fit_gyro(drive: Drive, segments: Segments) -> list[Estimate]:
    """Fit scale and offset of the gyro to the rotations by the reference."""
    described, gyro = drive.robot.imu, drive.gyro
    if described is None or len(gyro) < 2:
        return []
    begins, ends = segments.times.T
    measured = np.interp(ends, *gyro.T) - np.interp(begins, *gyro.T)
    turned = segments.moved[:, 2]
    rows = np.column_stack([measured, begins - ends])
    # turned = scale * measured - scale * offset * time
    spread = 2.0**0.5 * 0.0015
    information = rows.T @ rows / spread**2 + np.diag([WEAK**-2, 1.0])
    solution = np.linalg.solve(information, rows.T @ turned / spread**2 + [WEAK**-2, 0.0])
    off = turned - rows @ solution
    wide = max(1.0, float(np.sqrt((off**2).mean())) / spread)
    scale, drift = solution.tolist()
    deviations = wide * np.sqrt(np.diag(np.linalg.inv(information)))
    offset, uncertain = drift / scale, float(deviations[1]) / scale
    known = float(deviations[0]) <= DETERMINED
    turns = float(np.abs(turned).sum()) / (2.0 * np.pi)
    missing = "" if known else f"turns to both sides: {turns:.1f} turns so far"
    is_offset_known = uncertain <= OFFSET_DETERMINED
    more = "" if is_offset_known else "a longer drive"
    return [
        Estimate("imu.gyro_scale", "gyro scale", "", described.gyro_scale, scale,
                 float(deviations[0]), known, missing),
        Estimate("imu.gyro_offset", "gyro offset", "rad/s", described.gyro_offset, offset,
                 uncertain, is_offset_known, more),
    ]  # fmt: skip


def _rms(residuals: FloatArray) -> FloatArray:
    squared: FloatArray = np.sqrt((residuals**2).mean(axis=0))
    return squared


def _in_cm(length: float) -> str:
    return f"{100.0 * length:.4f} cm"
