"""Fit of a lidar's mount to a drive: the planar case of hand-eye calibration.

The base moves by A between two scans and the lidar by B, and the mount X makes A X = X B. Wheels
and gyro give A, the lidar's own scans give B. Turns determine the position of the mount, straight
drives its yaw: a robot that only turns in place moves the same with every yaw about its centre.
Height, roll and pitch do not show in a drive on a level floor.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import degrees

import numpy as np

from missions.commissioning.recording import fused_of, read_drive
from missions.commissioning.segments import Segments, segments_of
from stack.drivetrain.description import RobotDescription
from stack.errors import InputError
from stack.localisation.planar import as_pose, as_row
from stack.types import FloatArray, Observation, Pose2D, Scan

LENGTH = 0.5
"""Metres that a wheel rolls in a segment."""

LEAST_SEGMENTS = 12

POSITION_DETERMINED, YAW_DETERMINED = 0.005, 0.0035
"""Metres and radians (0.2 deg): a mount is determined if its deviations are smaller."""

WEAK = np.array([1.0, 1.0, 1.0])
"""Deviations before any measurement, m and rad."""

PASSES, ITERATIONS, STEP = 2, 10, 1e-6

HUBER = 3.0

MEDIAN = 1.18
"""Of the length of two normal numbers with the deviation 1."""


@dataclass(frozen=True, slots=True)
class MountFit:
    """The mount of a lidar.

    Attributes:
        lidar: its name.
        before: mount of the robot file, base frame.
        mount: fitted.
        deviations: (3,) standard deviations of x, y (m) and yaw (rad).
        residuals: root mean square distance between base and lidar in a segment, metres, before and
            after.
        segments: compared.
        missing: what is not determined, and the drive for it; empty if all is.
    """

    lidar: str
    before: Pose2D
    mount: Pose2D
    deviations: FloatArray
    residuals: tuple[float, float]
    segments: int
    missing: tuple[str, ...]

    @property
    def values(self) -> dict[Sequence[str], str]:
        """The determined values of the robot file as YAML, by path."""
        section = ("lidar",) if self.lidar == "lidar" else ("lidars", self.lidar)
        found: dict[Sequence[str], str] = {}
        if float(self.deviations[:2].max()) <= POSITION_DETERMINED:
            x, y = 100.0 * self.mount.x, 100.0 * self.mount.y
            found[*section, "position"] = f"[{x:.2f} cm, {y:.2f} cm]"
        if float(self.deviations[2]) <= YAW_DETERMINED:
            found[*section, "yaw"] = f"{degrees(self.mount.heading):.3f} deg"
        return found


def fit_mount(observations: Sequence[Observation], robot: RobotDescription, lidar: str) -> MountFit:
    """Fit the mount of a lidar to a recorded drive.

    The first pass corrects scans for the motion with the described mount, the second one with that
    of the first.

    Args:
        observations: in order, as measured.
        robot: with calibrated odometry.
        lidar: name of the lidar.

    Raises:
        InputError: the drive is too short, or the scans do not match.
    """
    base, before = fused_of(observations, robot), robot.real_lidars[lidar].mount
    mount, first = before, None
    for _ in range(PASSES):
        seen = [_mounted(observation, lidar, mount) for observation in observations]
        drive = replace(read_drive(seen, robot, lidar), wheels=base)
        segments = segments_of(drive, LENGTH)
        if len(segments.begins) < LEAST_SEGMENTS:
            raise InputError(
                f"the drive has {len(segments.begins)} usable segments for {lidar}, at least "
                f"{LEAST_SEGMENTS} are needed: drive longer"
            )
        problem = MountProblem(segments, robot, mount)
        first = problem.rms(as_row(before)) if first is None else first
        row, deviations = problem.solve()
        mount = as_pose(row)
    return MountFit(
        lidar, before, mount, deviations, (first or 0.0, problem.rms(row)),
        len(segments.begins), missing_drives(lidar, deviations, segments),
    )  # fmt: skip


def _mounted(observation: Observation, lidar: str, mount: Pose2D) -> Observation:
    scan = observation.named(lidar, Scan)
    if scan is None:
        return observation
    moved = replace(scan, mount=mount)
    return Observation(observation.time, {**observation.measurements, lidar: moved})


class MountProblem:
    """Displacements of base and lidar, whose mount is looked for.

    Args:
        segments: of the base by odometry (`path`) and by scans with a mount (`moved`).
        robot: whose wheels slip.
        assumed: that mount.
    """

    def __init__(self, segments: Segments, robot: RobotDescription, assumed: Pose2D) -> None:
        self._base = segments.by_wheels(np.eye(3))
        self._lidar = carried(segments.moved, as_row(assumed.inverse()))
        self._start = as_row(assumed)
        slip = max(robot.odometry.slip, 0.005)
        self._deviation = (0.5 * slip**2 * LENGTH + 2.0 * 0.004**2) ** 0.5

    def residuals(self, mount: FloatArray) -> FloatArray:
        """Return (n, 2) base displacements by the lidar without those by odometry, metres."""
        return carried(self._lidar, mount)[:, :2] - self._base[:, :2]

    def rms(self, mount: FloatArray) -> float:
        """Return the root mean square distance of a segment, metres."""
        return float(np.sqrt((self.residuals(mount) ** 2).sum(axis=1).mean()))

    def solve(self) -> tuple[FloatArray, FloatArray]:
        """Return the mount (3,) and its deviations."""
        mount, start = self._start.copy(), self._start
        weak = np.diag(WEAK**-2)
        for _ in range(ITERATIONS):
            off = self.residuals(mount)
            slopes = np.stack([
                (self.residuals(mount + STEP * axis) - off) / STEP for axis in np.eye(3)
            ], axis=-1)  # fmt: skip
            sizes = np.hypot(*off.T)
            spread = max(0.25 * self._deviation, float(np.median(sizes)) / MEDIAN)
            weights = np.minimum(1.0, HUBER * spread / np.maximum(sizes, 1e-12)) / spread**2
            hessian = np.einsum("n,nij,nik->jk", weights, slopes, slopes) + weak
            gradient = np.einsum("n,nij,ni->j", weights, slopes, off)
            change = -np.linalg.solve(hessian, gradient + weak @ (mount - start))
            mount = mount + change
            if float(np.abs(change).max()) < 1e-9:
                break
        return mount, np.sqrt(np.diag(np.linalg.inv(hessian)))


def carried(moved: FloatArray, mount: FloatArray) -> FloatArray:
    """Return (n, 3) X B X⁻¹ of displacements B (n, 3) and a mount X (3,)."""
    x, y, yaw = mount.tolist()
    c, s = np.cos(yaw), np.sin(yaw)
    ahead = c * moved[:, 0] - s * moved[:, 1]
    left = s * moved[:, 0] + c * moved[:, 1]
    turned_c, turned_s = np.cos(moved[:, 2]), np.sin(moved[:, 2])
    return np.column_stack([
        ahead + x - (turned_c * x - turned_s * y),
        left + y - (turned_s * x + turned_c * y),
        moved[:, 2],
    ])  # fmt: skip


def missing_drives(lidar: str, deviations: FloatArray, segments: Segments) -> tuple[str, ...]:
    """Return what is not determined, with the drive for it."""
    turned = float(np.abs(segments.moved[:, 2]).sum()) / (2.0 * np.pi)
    driven = float(np.hypot(*segments.moved[:, :2].T).sum())
    found = []
    if float(deviations[:2].max()) > POSITION_DETERMINED:
        millimetres = 1000.0 * float(deviations[:2].max())
        found.append(
            f"position of {lidar} (± {millimetres:.0f} mm): turns to both sides, {turned:.1f} "
            "turns so far"
        )
    if float(deviations[2]) > YAW_DETERMINED:
        found.append(
            f"yaw of {lidar} (± {degrees(deviations[2]):.2f} deg): straight drives, "
            f"{driven:.1f} m so far"
        )
    return tuple(found)
