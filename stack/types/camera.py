"""Cameras: their state, and the model: pinhole with distortion, and the mount on the robot.

Pixel coordinates count from the outer corner of the first pixel: its centre is (0.5, 0.5), and the
centre of a picture is (width / 2, height / 2). OpenCV and ROS count from the centre of the first
pixel; their principal points are smaller by 0.5.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import asin, atan, atan2, cos, hypot, inf, sin

import numpy as np
from numpy.typing import NDArray

from stack.types.distortion import DISTORTION, distorted, undistorted
from stack.types.geometry import FloatArray

_AHEAD = 1e-6
"""Metres; points nearer to the plane of the lens are not seen."""

_VERTICAL = 1e-9
"""Sine of the angle to the vertical below which a direction has no yaw."""


@dataclass(frozen=True, slots=True)
class CameraModel:
    """Intrinsics and mount of a camera: pinhole, with distortion if `distortion` is not empty.

    Attributes:
        width: pixels.
        height: pixels.
        focal_length: fx, pixels.
        position: (x, y, z) of the optical centre in the base frame, metres.
        pitch: radians, positive looking down.
        yaw: radians, positive to the left.
        focal_length_y: pixels; None: the same as fx.
        principal_point: (cx, cy) from the picture's corner, pixels; None: the picture's centre.
        distortion: (k1, k2, p1, p2, k3), or empty without distortion.
        roll: radians about the optical axis, positive clockwise seen from behind the camera.
    """

    width: int
    height: int
    focal_length: float
    position: tuple[float, float, float]
    pitch: float = 0.0
    yaw: float = 0.0
    focal_length_y: float | None = None
    principal_point: tuple[float, float] | None = None
    distortion: tuple[float, ...] = ()
    roll: float = 0.0

    def __post_init__(self) -> None:
        if len(self.distortion) not in (0, len(DISTORTION)):
            wanted = ", ".join(DISTORTION)
            raise ValueError(f"distortion must be empty or ({wanted}), got {self.distortion!r}")

    @property
    def fx(self) -> float:
        """Focal length along the rows, pixels."""
        return self.focal_length

    @property
    def fy(self) -> float:
        """Focal length along the columns, pixels."""
        return self.focal_length if self.focal_length_y is None else self.focal_length_y

    @property
    def cx(self) -> float:
        """Column of the principal point, pixels from the picture's corner."""
        return self.width / 2 if self.principal_point is None else self.principal_point[0]

    @property
    def cy(self) -> float:
        """Row of the principal point, pixels from the picture's corner."""
        return self.height / 2 if self.principal_point is None else self.principal_point[1]

    @property
    def is_distorted(self) -> bool:
        """Whether straight edges are seen curved."""
        return any(self.distortion)

    @property
    def matrix(self) -> FloatArray:
        """(3, 3) intrinsic matrix; the principal point counts from the picture's corner."""
        return np.array([[self.fx, 0, self.cx], [0, self.fy, self.cy], [0, 0, 1]], dtype=float)

    @property
    def horizontal_view(self) -> float:
        """Horizontal field of view at the row of the principal point, radians."""
        ends = self.rays(np.array([[0.0, self.cy], [float(self.width), self.cy]]))
        return atan(-ends[0, 0]) + atan(ends[1, 0])

    def base_from_optical(self) -> FloatArray:
        """(4, 4) transform from the optical frame (x right, y down, z forward) to the base."""
        cp, sp, cy, sy = cos(self.pitch), sin(self.pitch), cos(self.yaw), sin(self.yaw)
        forward = np.array([cp * cy, cp * sy, -sp])
        right = np.array([sy, -cy, 0.0])
        if self.roll:
            right = cos(self.roll) * right + sin(self.roll) * np.cross(forward, right)
        transform = np.eye(4)
        transform[:3, 0], transform[:3, 1] = right, np.cross(forward, right)
        transform[:3, 2], transform[:3, 3] = forward, self.position
        return transform

    def mounted_on(self, base_from_link: FloatArray) -> CameraModel:
        """Return the camera with its mount in the base frame.

        Args:
            base_from_link: (4, 4) pose of the link that carries the camera, whose mount is given in
                the frame of that link.
        """
        optical = base_from_link @ self.base_from_optical()
        right, forward = optical[:3, 0], optical[:3, 2]
        pitch = asin(max(-1.0, min(1.0, -float(forward[2]))))
        if hypot(forward[0], forward[1]) > _VERTICAL:
            yaw = atan2(forward[1], forward[0])
        else:
            yaw = atan2(right[0], -right[1])  # looks straight up or down: yaw and roll are one turn
        level = np.array([sin(yaw), -cos(yaw), 0.0])
        roll = atan2(float(right @ np.cross(forward, level)), float(right @ level))
        x, y, z = optical[:3, 3].tolist()
        return replace(self, position=(x, y, z), pitch=pitch, yaw=yaw, roll=roll)

    def project(self, points: FloatArray) -> FloatArray:
        """Return the pixels (n, 2) of points (n, 3) in the optical frame, metres.

        NaN: behind the lens, or beyond what the distortion model describes.
        """
        depth = np.where(points[:, 2] > _AHEAD, points[:, 2], np.nan)
        across = points[:, :2]
        if self.is_distorted:
            return self._pixels(distorted(across / depth[:, None], self.distortion))
        centre = np.array([self.cx, self.cy])
        pixels: FloatArray = np.array([self.fx, self.fy]) * across / depth[:, None] + centre
        return pixels

    def rays(self, pixels: FloatArray) -> FloatArray:
        """Return the points (n, 2) at depth 1 m, x and y in the optical frame, that pixels show.

        Args:
            pixels: (n, 2) columns and rows. NaN comes back for what the model does not describe.
        """
        seen = (pixels - [self.cx, self.cy]) / [self.fx, self.fy]
        rays: FloatArray = undistorted(seen, self.distortion) if self.is_distorted else seen
        return rays

    def undistort_points(self, pixels: FloatArray) -> FloatArray:
        """Return where a camera with the same matrix and without distortion sees what pixels show.

        Args:
            pixels: (n, 2) of this camera; without distortion they come back unchanged.
        """
        return self._pixels(self.rays(pixels)) if self.is_distorted else pixels

    def distort_points(self, pixels: FloatArray) -> FloatArray:
        """Invert `undistort_points`: return the pixels (n, 2) of this camera."""
        if not self.is_distorted:
            return pixels
        rays = (pixels - [self.cx, self.cy]) / [self.fx, self.fy]
        return self._pixels(distorted(rays, self.distortion))

    def rectifying_maps(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return columns and rows (height, width) of the pixels of a rectified picture.

        They are the maps of OpenCV's `remap`, which count from the centre of the first pixel;
        -1 where the picture shows nothing.
        """
        return as_maps(self.distort_points(self.pixel_centres()), self.height)

    def pixel_centres(self) -> FloatArray:
        """Return the centres (height * width, 2) of all pixels, row by row."""
        columns, rows = np.meshgrid(np.arange(self.width) + 0.5, np.arange(self.height) + 0.5)
        return np.column_stack([columns.ravel(), rows.ravel()])

    def is_invertible(self) -> bool:
        """Whether the model describes every pixel, so that each has one ray."""
        return not self.is_distorted or bool(np.isfinite(self.rays(self._border())).all())

    def _border(self) -> FloatArray:
        """Points (n, 2) along the border of the picture; the distortion is largest there."""
        share = np.linspace(0.0, 1.0, 33)
        zero, one = np.zeros_like(share), np.ones_like(share)
        sides = [(share, zero), (share, one), (zero, share), (one, share)]
        return np.concatenate(
            [np.column_stack([self.width * x, self.height * y]) for x, y in sides]
        )

    def _pixels(self, plane: FloatArray) -> FloatArray:
        pixels: FloatArray = plane * [self.fx, self.fy] + [self.cx, self.cy]
        return pixels


def as_maps(pixels: FloatArray, height: int) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return pixels (height * width, 2) as the two maps of OpenCV's `remap`; NaN becomes -1."""
    columns, rows = np.nan_to_num(pixels.T - 0.5, nan=-1.0).astype(np.float32)
    return columns.reshape(height, -1), rows.reshape(height, -1)


@dataclass(frozen=True, slots=True)
class CameraState:
    """State of a camera.

    Attributes:
        name: of the sensor.
        is_on: whether pictures are requested.
        age: seconds since its newest usable picture; inf before the first.
        fault: size | type | stamp | late | invalid | uniform | frozen | silent; empty if none.
    """

    name: str
    is_on: bool = False
    age: float = inf
    fault: str = ""
