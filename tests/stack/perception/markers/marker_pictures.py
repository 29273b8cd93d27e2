"""Pictures of markers rendered from known poses, and the pixels of their corners."""

from math import pi, radians, tan

import cv2
import numpy as np

from stack.perception.markers.square_pose import corners_in_map, map_from_marker
from stack.types import CameraModel, FloatArray, Image, Marker, Pose2D, wrap_angle

FOCAL = 160.0 / tan(radians(35.0))
"""Pixels; 320 wide with a field of view of 70 degrees."""

CAMERA = CameraModel(320, 240, FOCAL, (0.15, 0.0, 0.3), pitch=radians(-5.0))
WALL_MARKER = Marker(7, 0.2, (3.0, 1.0, 0.4), pi)


def optical_from(base: Pose2D, camera: CameraModel) -> np.ndarray:
    """(4, 4) transform of map points to the camera's optical frame."""
    map_from_base = np.eye(4)
    c, s = np.cos(base.heading), np.sin(base.heading)
    map_from_base[:2, :2] = [[c, -s], [s, c]]
    map_from_base[:2, 3] = base.x, base.y
    return np.linalg.inv(map_from_base @ camera.base_from_optical())


def rendered(
    base: Pose2D,
    markers: list[Marker],
    camera: CameraModel,
    generator: np.random.Generator,
    *,
    aliased: bool = False,
) -> Image:
    """What the camera sees of white boards 1.25 times the markers' size; grey elsewhere.

    `aliased` takes one sample a pixel, as simple renderers do, so that edges are stairs.
    """
    scale = 4  # drawn four times as fine and averaged, as a sensor's pixels do
    size = (camera.width * scale, camera.height * scale)
    canvas = np.full((size[1], size[0]), 130, dtype=np.uint8)
    optical_from_map = optical_from(base, camera)
    for marker in markers:
        dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, marker.dictionary))
        board = np.full((500, 500), 255, dtype=np.uint8)
        board[50:450, 50:450] = cv2.aruco.generateImageMarker(dictionary, marker.number, 400)
        half = 1.25 * marker.size / 2
        square = np.array([[-half, half], [half, half], [half, -half], [-half, -half]])
        points = np.column_stack([square, np.zeros(4), np.ones(4)])
        optical = (optical_from_map @ map_from_marker(marker) @ points.T)[:3]
        assert (optical[2] > 0.1).all()
        pixels = camera.matrix @ optical
        corners = ((pixels[:2] / pixels[2]).T * scale).astype(np.float32)
        source = np.array([[0, 0], [500, 0], [500, 500], [0, 500]], dtype=np.float32)
        # the camera model counts from pixels' edges, OpenCV from their centres
        half_pixel = np.float32(0.5)
        warp = cv2.getPerspectiveTransform(source - half_pixel, corners - half_pixel)
        mask = cv2.warpPerspective(np.full_like(board, 255), warp, size)
        drawn = cv2.warpPerspective(board, warp, size, flags=cv2.INTER_AREA)
        canvas = np.where(mask > 127, drawn, canvas)
    pixels = canvas.reshape(camera.height, scale, camera.width, scale)
    middle = pixels[:, 1:3, :, 1:3].mean(axis=(1, 3))
    grey = np.where(middle > 127, middle.max(), 0.0) if aliased else pixels.mean(axis=(1, 3))
    noisy = np.clip(grey + generator.normal(0.0, 2.0, grey.shape), 0, 255).astype(np.uint8)
    return Image(1.5, np.repeat(noisy[:, :, None], 3, axis=2), camera)


def facing(distance: float, bearing: float, off_axis: float) -> Pose2D:
    """A base pose so far from the wall marker, seen under `bearing` from its normal."""
    angle = WALL_MARKER.heading + bearing
    x = WALL_MARKER.position[0] + distance * np.cos(angle)
    y = WALL_MARKER.position[1] + distance * np.sin(angle)
    return Pose2D(x, y, wrap_angle(angle + pi + off_axis))


def seen_corners(base: Pose2D, marker: Marker, camera: CameraModel) -> FloatArray:
    """(4, 2) pixels of a marker's corners, from the image's corner."""
    points = np.column_stack([corners_in_map(marker), np.ones(4)])
    optical = (optical_from(base, camera) @ points.T)[:3]
    pixels = camera.matrix @ optical
    return (pixels[:2] / pixels[2]).T
