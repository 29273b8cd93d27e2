"""How the IMU of a log is mounted: by the transform of its frame, or else by gravity."""

from __future__ import annotations

from math import degrees

import numpy as np

from stack.types import FloatArray

LEVEL = np.radians(20.0)
"""Angle between up and the mean acceleration of a level IMU, at most: the robot may speed up by
3.5 m/s² or stand on a slope."""

LEAST_FORCE = 0.5
"""Smaller mean accelerations, in m/s² or g, are no measurement of gravity."""


def upright(topic: str, turn: FloatArray | None, force: FloatArray) -> tuple[FloatArray, str]:
    """Return the rotation base <- IMU, and a note about it; empty if there is nothing to tell.

    At rest the specific force points up. Without a transform, an IMU whose acceleration points
    elsewhere is turned until it does: that is right for the yaw rate, whatever its heading.

    Args:
        topic: of the IMU, for the note.
        turn: (3, 3) by the transform of its frame; None without one.
        force: (3,) mean specific force, frame of the IMU; zeros if it is not measured.
    """
    size = float(np.linalg.norm(force))
    if size < LEAST_FORCE:
        if turn is not None:
            return turn, ""
        return np.eye(3), f"{topic} has no transform and no acceleration: it is used as level"
    up = force / size if turn is None else turn @ force / size
    tilt = float(np.arccos(np.clip(up[2], -1.0, 1.0)))
    if turn is None:
        if tilt <= LEVEL:
            return np.eye(3), f"{topic} has no transform: it is used as level, as gravity says"
        note = f"{topic} has no transform; by gravity it is tilted by {degrees(tilt):.0f} deg"
        return _turned_up(up), f"{note} and turned upright"
    if tilt <= LEVEL:
        return turn, ""
    note = f"by gravity {topic} is tilted by {degrees(tilt):.0f} deg against its transform"
    return turn, f"{note}, which is used"


def _turned_up(up: FloatArray) -> FloatArray:
    """Return the (3, 3) smallest rotation that turns a unit vector to z."""
    x, y, z = up
    if z < -1.0 + 1e-6:
        return np.diag([1.0, -1.0, -1.0])
    # Rodrigues' formula for the axis up × z and the angle between them.
    cross = np.array([[0.0, 0.0, -x], [0.0, 0.0, -y], [x, y, 0.0]])
    rotation: FloatArray = np.eye(3) + cross + cross @ cross / (1.0 + z)
    return rotation
