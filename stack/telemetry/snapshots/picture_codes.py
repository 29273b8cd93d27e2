"""Pictures as they are recorded: JPEG, and PNG of millimetres."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stack.telemetry.codec import MalformedError
from stack.types import CameraModel, DepthImage, Image

JPEG_QUALITY = 80

MILLIMETRES = 1000.0
FARTHEST, NO_RETURN = 65_000, 65_535
"""Largest depth in a PNG, millimetres, and the number of +inf; 0 is NaN."""


@dataclass(frozen=True, slots=True)
class EncodedPicture:
    """A picture without its camera.

    Attributes:
        stamp: seconds.
        content: JPEG of an Image, PNG of the depths of a DepthImage.
        range_min: of a DepthImage, metres.
        range_max: of a DepthImage, metres.
    """

    stamp: float
    content: bytes
    range_min: float = 0.0
    range_max: float = 0.0


def encoded(image: Image | DepthImage) -> EncodedPicture:
    """Return a picture as it is recorded."""
    if isinstance(image, Image):
        return EncodedPicture(image.stamp, jpeg(image.pixels))
    content = depth_png(image.depth)
    return EncodedPicture(image.stamp, content, image.range_min, image.range_max)


def decoded_image(picture: EncodedPicture, camera: CameraModel) -> Image:
    """Return the picture of a camera.

    Raises:
        MalformedError: it is no picture of this camera.
    """
    import cv2

    pixels = _decoded(picture.content, cv2.IMREAD_COLOR)
    if pixels.dtype != np.uint8 or pixels.shape != (camera.height, camera.width, 3):
        raise MalformedError(f"a picture of {pixels.shape} {pixels.dtype}")
    rgb: NDArray[np.uint8] = np.ascontiguousarray(pixels[:, :, ::-1])
    return Image(picture.stamp, rgb, camera)


def decoded_depth(picture: EncodedPicture, camera: CameraModel) -> DepthImage:
    """Return the picture of a depth camera, exact to half a millimetre.

    Raises:
        MalformedError: it is no picture of this camera.
    """
    import cv2

    numbers = _decoded(picture.content, cv2.IMREAD_UNCHANGED)
    if numbers.dtype != np.uint16 or numbers.shape != (camera.height, camera.width):
        raise MalformedError(f"a depth picture of {numbers.shape} {numbers.dtype}")
    depth = (numbers / MILLIMETRES).astype(np.float32)
    depth[numbers == 0], depth[numbers == NO_RETURN] = np.nan, np.inf
    return DepthImage(picture.stamp, depth, camera, picture.range_min, picture.range_max)


def jpeg(pixels: NDArray[np.uint8]) -> bytes:
    """Return (height, width, 3) RGB as JPEG."""
    import cv2

    bgr = np.ascontiguousarray(pixels[:, :, ::-1])
    _, content = cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    return content.tobytes()


def depth_png(depth: NDArray[np.float32]) -> bytes:
    """Return (height, width) depths, metres, as PNG of millimetres, 16 bits."""
    import cv2

    known = np.nan_to_num(MILLIMETRES * depth, nan=0.0, posinf=NO_RETURN, neginf=0.0)
    numbers = np.where(np.isposinf(depth), NO_RETURN, np.clip(np.rint(known), 0, FARTHEST))
    fast = [cv2.IMWRITE_PNG_COMPRESSION, 1]
    _, content = cv2.imencode(".png", numbers.astype(np.uint16), fast)
    return content.tobytes()


def _decoded(content: bytes, mode: int) -> NDArray[Any]:
    import cv2

    try:
        found = cv2.imdecode(np.frombuffer(content, np.uint8), mode)
    except cv2.error:
        found = None
    if found is None:
        raise MalformedError("a picture that cannot be decoded")
    return found
