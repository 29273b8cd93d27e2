"""Transforms between the frames of a ROS bag, as (4, 4) matrices along the tree of frames."""

from __future__ import annotations

from math import sqrt
from typing import Any

import numpy as np

from stack.types import FloatArray

Frames = dict[str, tuple[str, FloatArray]]
"""Parent of each frame, and the transform parent <- frame."""


def add_transforms(frames: Frames, message: Any) -> None:
    """Add the transforms of a TFMessage; the first one of a frame counts."""
    for item in message.transforms:
        child = item.child_frame_id.lstrip("/")
        frames.setdefault(child, (item.header.frame_id.lstrip("/"), _matrix(item.transform)))


def _matrix(transform: Any) -> FloatArray:
    """Return the (4, 4) matrix of a geometry_msgs/Transform."""
    q, t = transform.rotation, transform.translation
    matrix = np.eye(4)
    matrix[:3, :3] = _rotation(q.x, q.y, q.z, q.w)
    matrix[:3, 3] = t.x, t.y, t.z
    return matrix


def _rotation(x: float, y: float, z: float, w: float) -> FloatArray:
    """Return the (3, 3) rotation of a quaternion; the identity for one of length 0."""
    norm = sqrt(x * x + y * y + z * z + w * w)
    if not norm > 1e-9:
        return np.eye(3)
    x, y, z, w = x / norm, y / norm, z / norm, w / norm
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip


def between(frames: Frames, base: str, frame: str) -> FloatArray | None:
    """Return the (4, 4) transform base <- frame along the tree of frames; None without one."""
    to_root, there = _to_root(frames, frame)
    base_root, here = _to_root(frames, base)
    if there != here:
        return None
    found: FloatArray = np.linalg.inv(base_root) @ to_root
    return found


def _to_root(frames: Frames, frame: str) -> tuple[FloatArray, str]:
    matrix = np.eye(4)
    for _ in range(len(frames)):
        if frame not in frames:
            break
        frame, step = frames[frame]
        matrix = step @ matrix
    return matrix, frame
