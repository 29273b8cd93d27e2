"""What draws pinhole pictures of a PyBullet client: its own software renderer, or OpenGL.

The software renderer draws the same picture on every machine and is the default. OpenGL is three
to twelve times as fast; its pictures differ on edges and round shapes, and between drivers.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from stack.errors import BodyError
from stack.sim.physics.pybullet_engine.gl_drawing import GlDrawing
from stack.types import CameraModel, FloatArray


class Drawing(Protocol):
    """Draws the bodies of a PyBullet client.

    Attributes:
        driver: of OpenGL; empty for the software renderer.
    """

    driver: str

    def draw(self, view: FloatArray) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        """Return colours (height, width, 3) and depths (height, width), 0 near and 1 far.

        Args:
            view: (4, 4) OpenGL eye frame from world.
        """

    def add_bodies(self) -> None:
        """Prepare the bodies of the client that are new."""

    def close(self) -> None:
        """Release what the drawing holds. Safe to call twice."""


class TinyDrawing:
    """Draws with TinyRenderer, the software renderer of PyBullet.

    Args:
        bullet: the pybullet module.
        client: number of the client.
        model: a pinhole camera.
        projection: (4, 4) of the camera, see pinhole.py.
    """

    driver = ""

    def __init__(
        self, bullet: Any, client: int, model: CameraModel, projection: FloatArray
    ) -> None:
        self._bullet, self._client, self._model = bullet, client, model
        # TinyRenderer samples column i at (x + 1) width / 2 = i, and row j at (y + 1) height / 2 =
        # height - 1 - j, where the camera model has the centres of pixels at i + 0.5 and j + 0.5.
        self._projection = projection.copy()
        self._projection[0, 2] += 1.0 / model.width
        self._projection[1, 2] += 1.0 / model.height

    def draw(self, view: FloatArray) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        """As in `Drawing`."""
        model = self._model
        answer = self._bullet.getCameraImage(
            model.width,
            model.height,
            viewMatrix=view.T.ravel().tolist(),
            projectionMatrix=self._projection.T.ravel().tolist(),
            shadow=0,
            renderer=self._bullet.ER_TINY_RENDERER,
            flags=self._bullet.ER_NO_SEGMENTATION_MASK,
            physicsClientId=self._client,
        )
        shape = (model.height, model.width)
        pixels: NDArray[np.uint8] = np.asarray(answer[2], dtype=np.uint8).reshape(*shape, 4)
        return pixels[:, :, :3], np.asarray(answer[3], dtype=np.float32).reshape(shape)

    def add_bodies(self) -> None:
        """Do nothing: the renderer draws all bodies of the client."""

    def close(self) -> None:
        """Do nothing: the client belongs to the caller."""


def drawing_of(  # noqa: PLR0913 - the choice, and what both kinds need
    choice: str, bullet: Any, client: int, model: CameraModel, matrix: FloatArray,
    textures: Mapping[int, NDArray[np.uint8]],
) -> Drawing:  # fmt: skip
    """Return what draws the pictures.

    Args:
        choice: tiny | gl | auto: OpenGL where it works, and a line on standard error where not.
        bullet: the pybullet module.
        client: number of the client.
        model: a pinhole camera.
        matrix: its projection.
        textures: body number -> (rows, columns, 3) uint8, of textured bodies.

    Raises:
        BodyError: OpenGL was chosen and cannot be used.
    """
    tiny = TinyDrawing(bullet, client, model, matrix)
    if choice == "tiny":
        return tiny
    try:
        return GlDrawing(bullet, client, (model.width, model.height), matrix, textures)
    except BodyError as error:
        return instead(choice, tiny, error)


def instead(choice: str, tiny: TinyDrawing, error: BodyError) -> Drawing:
    """Return what draws after OpenGL has failed, and say so on standard error.

    Raises:
        BodyError: the same one, if OpenGL was chosen.
    """
    if choice == "gl":
        raise error
    print(f"pictures are drawn by TinyRenderer: {error}", file=sys.stderr, flush=True)
    return tiny
