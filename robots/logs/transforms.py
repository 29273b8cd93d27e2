"""Transforms between the frames of a ROS bag, as (4, 4) matrices along the tree of frames."""

from __future__ import annotations

from math import hypot
from typing import Any

import numpy as np

from stack.geometry.rotations import from_quaternion
from stack.types import FloatArray

Frames = dict[str, tuple[str, FloatArray]]
"""Parent of each frame, and the transform parent <- frame."""

UNTURNED = (0.0, 0.0, 0.0, 1.0)


def add_transforms(frames: Frames, message: Any) -> None:
    """Add the transforms of a TFMessage; the first one of a frame counts."""
    for item in message.transforms:
        q, t = item.transform.rotation, item.transform.translation
        turn = q.x, q.y, q.z, q.w
        turn = turn if hypot(*turn) > 1e-9 else UNTURNED  # some writers leave it empty
        matrix = from_quaternion((t.x, t.y, t.z), turn)
        child, parent = item.child_frame_id.lstrip("/"), item.header.frame_id.lstrip("/")
        frames.setdefault(child, (parent, matrix))


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
