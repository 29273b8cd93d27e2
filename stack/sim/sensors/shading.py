"""Shadows in simulated pictures: pixels whose points are in a shadow of the world are darker.

What mirrors show is not darkened.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stack.sim.sensors.pinhole import FLIP, distances
from stack.sim.sensors.requests import RenderSetup
from stack.types import CameraModel, FloatArray


class Shading:
    """Darkens pinhole pictures of one camera.

    Args:
        setup: world with shadows, and camera.
        model: the pinhole camera that is drawn.
    """

    def __init__(self, setup: RenderSetup, model: CameraModel) -> None:
        self._setup, self._shape = setup, (model.height, model.width)
        across = model.rays(model.pixel_centres())
        self._rays = np.column_stack([across, np.ones(len(across))])

    def darkened(
        self, colours: NDArray[np.uint8], depth: NDArray[np.float32], view: FloatArray
    ) -> NDArray[np.uint8]:
        """Return a picture with its shadows.

        Args:
            colours: (height, width, 3) in full light.
            depth: (height, width) depth buffer of the same picture.
            view: (4, 4) OpenGL eye frame from world.
        """
        world_from_optical = np.linalg.inv(view) @ FLIP
        away = distances(depth, self._setup.camera).ravel()
        points = self._rays @ world_from_optical[:2, :3].T * away[:, None]
        x, y = (points + world_from_optical[:2, 3]).T
        share = np.ones(len(points))
        for shadow in self._setup.world.shadows:
            x_min, y_min, x_max, y_max = shadow.bounds
            inside = (x >= x_min) & (x <= x_max) & (y >= y_min) & (y <= y_max)
            share[inside] = np.minimum(share[inside], shadow.light)
        darker = np.rint(colours * share.reshape(*self._shape, 1)).astype(np.uint8)
        return darker
