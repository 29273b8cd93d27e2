"""Virtual scans: what a depth camera sees in a band of heights, as a planar lidar would.

After the ROS package depthimage_to_laserscan, but for cameras at any pitch: a pixel belongs to the
beam of its bearing, and its height decides whether it counts.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from stack.drivetrain.description import (
    SCAN_SUFFIX,
    DepthCameraDescription,
    DepthScanDescription,
    LidarDescription,
    RobotDescription,
)
from stack.perception.depth.cloud import rays, used_pixels
from stack.types import DepthImage, Observation, Scan

TILT = 0.015
"""Error of the camera's pitch, radians, by which the lower edge of the band rises with the
distance: far floor is no obstacle."""


class DepthScans:
    """Makes the virtual scans of a robot."""

    def __init__(self, robot: RobotDescription) -> None:
        self._scans = {
            name: VirtualScan(camera, camera.scan, robot.depth_scans[f"{name}{SCAN_SUFFIX}"])
            for name, camera in robot.depth_cameras.items()
            if camera.scan is not None
        }

    @property
    def is_on(self) -> bool:
        """Whether the depth cameras shall take pictures for scans."""
        return bool(self._scans)

    def added_to(self, observation: Observation) -> Observation:
        """Return the observation with a scan for each new picture of a camera that has one."""
        found = {
            f"{name}{SCAN_SUFFIX}": self._scans[name].of(image)
            for name, image in observation.of(DepthImage).items()
            if name in self._scans
        }
        if not found:
            return observation
        return replace(observation, measurements={**observation.measurements, **found})


class VirtualScan:
    """Converts the pictures of one camera into scans of the lidar that they stand for."""

    def __init__(
        self, camera: DepthCameraDescription, band: DepthScanDescription, lidar: LidarDescription
    ) -> None:
        self._lidar, self._least = lidar, band.least_pixels
        directions, height = rays(camera.model), camera.model.position[2]
        flat = np.hypot(directions[:, :, 0], directions[:, :, 1]).ravel()
        rise = directions[:, :, 2].ravel()
        bearings = (
            np.arctan2(directions[:, :, 1], directions[:, :, 0]).ravel() - lidar.mount.heading
        )
        bearings = (bearings + np.pi) % (2.0 * np.pi) - np.pi
        self._increment = lidar.field_of_view / (lidar.beams - 1)
        beams = np.rint((bearings + 0.5 * lidar.field_of_view) / self._increment).astype(np.int64)
        self._pixels = _by_beam(beams, lidar.beams)
        self._flat = np.append(flat, 1.0).astype(np.float32)[self._pixels]
        self._rise = np.append(rise, 0.0).astype(np.float32)[self._pixels]
        self._low, self._high = band.low - height, band.high - height

    def of(self, image: DepthImage) -> Scan:
        """Return the scan of a picture.

        A beam in which nothing was measured is NaN; one that saw nothing in the band is +inf.
        """
        lidar = self._lidar
        depth = np.append(used_pixels(image), np.float32(np.nan))[self._pixels]
        away, rise = depth * self._flat, depth * self._rise
        counts = (depth >= image.range_min) & (depth <= image.range_max)
        counts &= (rise >= self._low + TILT * away) & (rise <= self._high)
        ranges = np.where(counts, away, np.float32(np.inf))
        kth = min(self._least, ranges.shape[1]) - 1
        found: NDArray[np.float32] = np.partition(ranges, kth, axis=1)[:, kth]
        found[found > lidar.range_max] = np.inf
        blind = np.isnan(depth).all(axis=1) | (found < lidar.range_min)
        found[blind] = np.nan
        return Scan(
            image.stamp, found, -0.5 * lidar.field_of_view, self._increment,
            lidar.range_min, lidar.range_max, lidar.mount,
        )  # fmt: skip


def _by_beam(beams: NDArray[np.int64], count: int) -> NDArray[np.int64]:
    """Return (count, most) the pixels of each beam; the rest of a row is one beyond the last."""
    rows = [np.flatnonzero(beams == beam) for beam in range(count)]
    table = np.full((count, max(map(len, rows))), beams.size)
    for beam, pixels in enumerate(rows):
        table[beam, : len(pixels)] = pixels
    return table
