"""Distortion of simulated pictures: a larger pinhole picture, seen through the lens.

The renderer draws pinhole pictures only. For a camera with distortion it draws one that holds all
that the camera sees, and each pixel takes its value from where its ray meets that picture.
"""

from __future__ import annotations

from dataclasses import replace
from math import ceil
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stack.types import CameraModel
from stack.types.camera import as_maps

FINEST = 2.0
"""Largest resolution of the pinhole picture in that of the camera; where the lens magnifies more,
pixels are interpolated."""

LARGEST = 4096
"""Pixels of a side of the pinhole picture; wider views are drawn with a lower resolution."""

_MARGIN = 2
"""Pixels around what the camera sees, for the interpolation."""


class Lens:
    """Maps a pinhole picture to that of a camera with distortion.

    Attributes:
        pinhole: the camera whose pictures are rendered; the camera itself without distortion.
    """

    def __init__(self, camera: CameraModel) -> None:
        self._camera = camera
        self._maps: tuple[NDArray[np.float32], NDArray[np.float32]] | None = None
        self.pinhole = camera
        if camera.is_distorted:
            self._build(camera)

    def _build(self, camera: CameraModel) -> None:
        rays = camera.rays(camera.pixel_centres())
        first, last = np.nanmin(rays, axis=0), np.nanmax(rays, axis=0)
        scale = _resolution(camera, rays.reshape(camera.height, camera.width, 2))
        focal = np.array([camera.fx, camera.fy])
        scale = min(scale, float(((LARGEST - 2 * _MARGIN) / (focal * (last - first))).min()))
        width, height = (ceil(side) + 2 * _MARGIN for side in scale * focal * (last - first))
        cx, cy = (_MARGIN - scale * focal * first).tolist()
        self.pinhole = replace(
            camera, width=width, height=height, focal_length=scale * camera.fx,
            focal_length_y=scale * camera.fy, principal_point=(cx, cy), distortion=(),
        )  # fmt: skip
        self._maps = as_maps(rays * scale * focal + [cx, cy], camera.height)

    def seen(self, picture: Any, *, smooth: bool) -> Any:
        """Return the camera's picture (height, width, …) of a pinhole picture.

        Args:
            picture: of `pinhole`: colours, or distances along the optical axis.
            smooth: whether to interpolate; distances are not, since the mean of two surfaces is a
                place where there is none.
        """
        if self._maps is None:
            return picture
        import cv2

        kind = cv2.INTER_LINEAR if smooth else cv2.INTER_NEAREST
        pixels: Any = np.ascontiguousarray(picture)
        return cv2.remap(pixels, *self._maps, kind)


def _resolution(camera: CameraModel, rays: Any) -> float:
    """Return how much finer than the camera the pinhole picture has to be, at most FINEST."""
    columns = camera.fx * np.diff(rays[:, :, 0], axis=1)
    rows = camera.fy * np.diff(rays[:, :, 1], axis=0)
    finest = min(float(np.nanmin(columns)), float(np.nanmin(rows)))
    return float(np.clip(1.0 / max(finest, 1e-6), 1.0, FINEST))
