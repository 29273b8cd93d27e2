"""Pictures of cameras and depth cameras in rerun, each with its frustum, and depth obstacles."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import rerun as rr

from stack.telemetry.rerun.recording import BASE, Recording
from stack.telemetry.snapshots.picture_codes import MILLIMETRES, depth_png, jpeg
from stack.types import CameraModel, DepthImage, FloatArray, Image

CAMERA, DEPTH = "camera", "depth"
"""Entities below `world`, and first parts of the names of their frames."""

PICTURE = f"{CAMERA}_picture"
"""Frame of the camera's picture."""

CAMERA_COLOUR, DEPTH_COLOUR = (94, 200, 255), (200, 230, 76)


_rectifying_maps = lru_cache(maxsize=1)(CameraModel.rectifying_maps)


def draw_colour_picture(recording: Recording, image: Image) -> None:
    """Log a rectified picture as JPEG; before the first one, log the camera's pose and model."""
    import cv2

    _frustum(recording, CAMERA, image.camera, CAMERA_COLOUR)
    pixels = image.pixels
    if image.camera.is_distorted:  # the viewer's camera is a pinhole
        maps = _rectifying_maps(image.camera)
        pixels = cv2.remap(pixels, *maps, cv2.INTER_LINEAR)  # type: ignore[assignment]
    picture = rr.EncodedImage(contents=jpeg(pixels), media_type="image/jpeg")
    recording.stream.log(f"world/{CAMERA}/picture", picture)


def draw_depth_picture(recording: Recording, image: DepthImage) -> None:
    """Log a depth picture as PNG of millimetres; 0 where nothing was measured."""
    _frustum(recording, DEPTH, image.camera, DEPTH_COLOUR)
    measured = np.where(np.isfinite(image.depth), image.depth, np.float32(0.0))
    picture = rr.EncodedDepthImage(
        blob=depth_png(measured), media_type="image/png", meter=MILLIMETRES,
        depth_range=[0.0, MILLIMETRES * image.range_max],
    )  # fmt: skip
    recording.stream.log(f"world/{DEPTH}/picture", picture)


def draw_depth_points(recording: Recording, points: FloatArray) -> None:
    """Draw the obstacles of the depth cameras, (n, 3) map frame; hide them if there are none."""
    if not len(points):
        recording.hide("world/depth_points")
        return
    recording.show_row("world/depth_points", rr.Points3D, positions=points)


def picture_frame(name: str) -> str:
    """Return the name of the frame of a camera's picture."""
    return f"{name}_picture"


def _frustum(
    recording: Recording, name: str, camera: CameraModel, colour: tuple[int, int, int]
) -> None:
    """Log a camera's pose and model, before its first picture."""
    optical, picture = f"{name}_optical", picture_frame(name)
    if not recording.frame(f"world/{name}/picture", picture):
        return
    transform = camera.base_from_optical()
    mount = rr.Transform3D(
        translation=transform[:3, 3], mat3x3=transform[:3, :3],
        parent_frame=BASE, child_frame=optical,
    )  # fmt: skip
    lens = rr.Pinhole(
        image_from_camera=camera.matrix, width=camera.width, height=camera.height,
        parent_frame=optical, child_frame=picture,
        image_plane_distance=0.5, color=colour, line_width=0.006,
    )  # fmt: skip
    recording.stream.log(f"world/{name}/mount", mount, static=True)
    recording.stream.log(f"world/{name}/lens", lens, static=True)
