"""Trajectory files: TUM's format and `t x y theta`.

TUM (J. Sturm et al., "A Benchmark for the Evaluation of RGB-D SLAM Systems", IROS 2012): a line is
`t x y z qx qy qz qw`. Stamps are seconds since 1970 with microseconds; poses keep every bit.
Code: E404.
"""

from __future__ import annotations

from math import atan2, cos, sin
from pathlib import Path

import numpy as np

from stack.documents.files import JSON_BYTES, decoded, read_input
from stack.errors import Finding, InputError, Mark
from stack.types import FloatArray, Pose2D

TRAJECTORY = "E404"
COLUMNS = {4: "t x y theta", 8: "t x y z qx qy qz qw"}


def tum_text(stamps: FloatArray, poses: list[Pose2D]) -> str:
    """Return a trajectory in TUM's format; stamps (n,) seconds."""
    return "".join(
        f"{stamp:.6f} {pose.x!r} {pose.y!r} 0 0 0 {sin(pose.heading / 2)!r} "
        f"{cos(pose.heading / 2)!r}\n"
        for stamp, pose in zip(stamps.tolist(), poses, strict=True)
    )


def plain_text(stamps: FloatArray, poses: list[Pose2D]) -> str:
    """Return a trajectory with the lines `t x y theta`; stamps (n,) seconds."""
    return "".join(
        f"{stamp:.6f} {pose.x!r} {pose.y!r} {pose.heading!r}\n"
        for stamp, pose in zip(stamps.tolist(), poses, strict=True)
    )


def read_trajectory(path: Path) -> tuple[FloatArray, list[Pose2D]]:
    """Read a trajectory in either format; lines that begin with # are comments.

    Returns:
        (n,) stamps in seconds, and the poses.

    Raises:
        InputError: the file cannot be read, or a line is damaged; with its number.
    """
    stamps: list[float] = []
    poses: list[Pose2D] = []
    text = decoded(read_input(path, "trajectory", JSON_BYTES), path)
    for number, line in enumerate(text.splitlines(), 1):
        words = line.split("#")[0].split()
        if not words:
            continue
        try:
            values = [float(word) for word in words]
        except ValueError:
            values = []
        if len(values) not in COLUMNS or not np.isfinite(values).all():
            sentence = f"expected {' or '.join(COLUMNS.values())}, got {line.strip()[:60]!r}"
            raise InputError([Finding(Mark(str(path), number), TRAJECTORY, sentence)])
        stamps.append(values[0])
        poses.append(_pose(values))
    return np.array(stamps, dtype=np.float64), poses


def _pose(values: list[float]) -> Pose2D:
    if len(values) == 4:
        return Pose2D(*values[1:])
    x, y = values[1:3]
    qx, qy, qz, qw = values[4:]
    return Pose2D(x, y, atan2(2.0 * (qw * qz + qx * qy), 1.0 - 2.0 * (qy * qy + qz * qz)))
