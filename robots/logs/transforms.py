"""Transforms between the frames of a ROS bag."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import numpy as np

from stack.errors import FrameError
from stack.frames.tree import FrameTree
from stack.geometry.rotations import from_quaternion
from stack.types import FloatArray


def add_transforms(frames: FrameTree, message: Any) -> None:
    """Add the transforms of a TFMessage as fixed ones; the first one of a frame counts."""
    for item in message.transforms:
        q, t = item.transform.rotation, item.transform.translation
        transform = from_quaternion((t.x, t.y, t.z), (q.x, q.y, q.z, q.w))
        parent, child = (name.lstrip("/") for name in (item.header.frame_id, item.child_frame_id))
        if frames.parent_of(child) is None:
            with suppress(FrameError):  # a loop: the frames above it are known without it
                frames.fix(parent, child, transform)


def between(frames: FrameTree, base: str, frame: str) -> FloatArray | None:
    """Return the (4, 4) transform base <- frame; None if the log does not tell it."""
    if frame == base:
        return np.eye(4)
    try:
        return frames.lookup(base, frame)
    except FrameError:
        return None
