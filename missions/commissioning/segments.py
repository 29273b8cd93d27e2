"""Segments of a drive: displacements by the wheels and by the reference, with their errors."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot

import numpy as np
from numpy.typing import NDArray

from missions.commissioning.recording import Drive
from stack.drivetrain.description import RobotDescription
from stack.localisation.fusion.wheels_gyro import wheel_slip
from stack.types import FloatArray, Pose2D

LENGTH = 0.5
"""Metres that a wheel rolls in a segment. In shorter ones the reference's error outweighs slip; in
longer ones the heading errors of slip bend the way by the wheels, which makes it too short."""

LONGEST_GAP = 1.0
"""Seconds without a reference pose after which a segment ends without use."""

POSITION_DEVIATION, HEADING_DEVIATION = 0.004, 0.0015
"""Of a reference pose, metres and radians: measured in furnished rooms of 5 m with a lidar of 1 cm
noise. Residuals correct the deviations that follow from them."""


@dataclass(frozen=True, slots=True)
class Segments:
    """Displacements of the base between pairs of reference poses, in the frame of the first one.

    Attributes:
        begins: (n,) index of the wheels' pose at the beginning of each segment, see `path`.
        ends: (n,) at its end.
        path: (m, 3) displacements by the wheels from each pose to the next, as described.
        moved: (n, 3) displacement of each segment by the reference: x, y, heading.
        roots: (n, 3, 3) whitening matrices: of residuals times these the covariance is 1.
        times: (n, 2) stamps of beginning and end, seconds.
    """

    begins: NDArray[np.int64]
    ends: NDArray[np.int64]
    path: FloatArray
    moved: FloatArray
    roots: FloatArray
    times: FloatArray

    def by_wheels(self, correction: FloatArray) -> FloatArray:
        """Return (n, 3) the displacements by the wheels.

        Args:
            correction: (3, 3) matrix that turns a small displacement as described into the true
                one.
        """
        track = chained(self.path @ correction.T)
        return relative(track[self.begins], track[self.ends])

    def residuals(self, correction: FloatArray) -> FloatArray:
        """Return (n, 3) the reference's displacements without those by the wheels."""
        off = self.moved - self.by_wheels(correction)
        off[:, 2] = (off[:, 2] + np.pi) % (2.0 * np.pi) - np.pi
        return off


def segments_of(drive: Drive, length: float = LENGTH) -> Segments:
    """Cut a drive into segments.

    Args:
        drive: with poses by wheels and reference.
        length: metres that a wheel rolls in a segment.
    """
    stamps = np.union1d(drive.wheels.stamps, drive.reference.stamps)
    inside = (stamps >= drive.wheels.stamps[0]) & (stamps <= drive.wheels.stamps[-1])
    stamps = stamps[inside]
    wheels = drive.wheels.at(stamps)
    path = relative(wheels[:-1], wheels[1:])
    rolled = _rolled(path, drive.robot)
    marks = np.searchsorted(stamps, drive.reference.stamps[
        (drive.reference.stamps >= stamps[0]) & (drive.reference.stamps <= stamps[-1])
    ])  # fmt: skip
    pairs: list[tuple[int, int]] = []
    begin = int(marks[0])
    for before, mark in zip(marks[:-1].tolist(), marks[1:].tolist(), strict=True):
        if stamps[mark] - stamps[before] > LONGEST_GAP:
            begin = mark
        elif rolled[mark] - rolled[begin] >= length:
            pairs.append((begin, mark))
            begin = mark
    index = np.array(pairs, dtype=np.int64).reshape(-1, 2)
    placed = drive.reference.at(stamps)
    moved = relative(placed[index[:, 0]], placed[index[:, 1]])
    roots = np.array([_root(path[i:j], drive.robot) for i, j in pairs]).reshape(-1, 3, 3)
    return Segments(index[:, 0], index[:, 1], path, moved, roots, stamps[index])


def relative(before: FloatArray, after: FloatArray) -> FloatArray:
    """Return (n, 3) poses in the frames of others (n, 3); headings are not wrapped."""
    off = after - before
    c, s = np.cos(before[:, 2]), np.sin(before[:, 2])
    return np.column_stack(
        [c * off[:, 0] + s * off[:, 1], c * off[:, 1] - s * off[:, 0], off[:, 2]]
    )


def chained(path: FloatArray) -> FloatArray:
    """Return (n + 1, 3) the poses along small displacements (n, 3), from the origin."""
    headings = np.concatenate([[0.0], np.cumsum(path[:, 2])])
    c, s = np.cos(headings[:-1]), np.sin(headings[:-1])
    x = np.concatenate([[0.0], np.cumsum(c * path[:, 0] - s * path[:, 1])])
    y = np.concatenate([[0.0], np.cumsum(s * path[:, 0] + c * path[:, 1])])
    return np.column_stack([x, y, headings])


def _rolled(path: FloatArray, robot: RobotDescription) -> FloatArray:
    """Return (n + 1,) metres that a wheel has rolled up to each pose."""
    lever = 0.5 * robot.wheels.turning_length if robot.drivetrain.turns_in_place else 0.0
    steps = np.hypot(path[:, 0], path[:, 1]) + lever * np.abs(path[:, 2])
    return np.concatenate([[0.0], np.cumsum(steps)])


def _root(path: FloatArray, robot: RobotDescription) -> FloatArray:
    """Return the (3, 3) whitening matrix of a segment with this path.

    Slip adds up over what the wheels roll. An error of the heading on the way moves the end aside.
    """
    length = float(np.hypot(path[:, 0], path[:, 1]).sum())
    turned = float(np.abs(path[:, 2]).sum())
    covariance = wheel_slip(robot).covariance(Pose2D(length, 0.0, turned)).copy()
    covariance[2, 2] += (robot.turn_deviation * turned) ** 2
    reach = hypot(*path[:, :2].sum(axis=0).tolist())
    covariance[1, 1] += covariance[2, 2] * reach**2 / 3.0
    covariance += 2.0 * np.diag([POSITION_DEVIATION, POSITION_DEVIATION, HEADING_DEVIATION]) ** 2
    root: FloatArray = np.linalg.inv(np.linalg.cholesky(covariance))
    return root
