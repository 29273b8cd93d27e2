"""Geometry of simulated pinhole pictures, and what is seen through glass."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stack.drivetrain.description import CameraDescription, DepthCameraDescription
from stack.types import CameraModel, FloatArray

NEAR = 0.02
"""Near clipping plane, metres in front of the camera."""

TINT = 0.12
"""Share of a pixel's colour that is that of the glass in front; the rest shines through."""

FLIP = np.diag([1.0, -1.0, -1.0, 1.0])
"""Transform between OpenGL's eye frame (y up, looking along -z) and the optical frame."""


def projection(model: CameraModel, far: float) -> FloatArray:
    """Return (4, 4) OpenGL clip space from eye frame, for a pinhole camera.

    Args:
        model: of the camera; its distortion is ignored.
        far: clipping plane, metres.
    """
    width, height = model.width, model.height
    matrix = np.zeros((4, 4))
    matrix[0, 0], matrix[1, 1] = 2.0 * model.fx / width, 2.0 * model.fy / height
    matrix[0, 2], matrix[1, 2] = 1.0 - 2.0 * model.cx / width, 2.0 * model.cy / height - 1.0
    matrix[2, 2], matrix[2, 3] = -(far + NEAR) / (far - NEAR), -2.0 * far * NEAR / (far - NEAR)
    matrix[3, 2] = -1.0
    return matrix


def tinted(
    colours: NDArray[np.uint8], panes: NDArray[np.uint8], covered: NDArray[np.bool_]
) -> NDArray[np.uint8]:
    """Return a picture (height, width, 3) of what is seen through glass, or in a mirror.

    Args:
        colours: without the glass.
        panes: with the glass as if it were not transparent.
        covered: (height, width) where glass is in front; elsewhere `colours` is kept.
    """
    mixed = np.rint((1.0 - TINT) * colours + TINT * panes).astype(np.uint8)
    return np.where(covered[:, :, None], mixed, colours)


def distances(
    buffer: NDArray[np.float32], camera: CameraDescription | DepthCameraDescription
) -> FloatArray:
    """Return distances along the optical axis, metres, from depths 0 near to 1 far, same shape."""
    far = far_plane(camera)
    found: FloatArray = far * NEAR / (far - (far - NEAR) * buffer.astype(np.float64))
    return found


def far_plane(camera: CameraDescription | DepthCameraDescription) -> float:
    """Return the distance of the far clipping plane, metres; noise may bring what is beyond."""
    beyond = 1.25 if isinstance(camera, DepthCameraDescription) else 1.0
    return beyond * camera.range_max
