"""A block seen again from near, by a depth camera in the hand above it.

The points of its top give where it is; size and turn are those that it was found with.
"""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np

from stack.frames.tree import inverse
from stack.perception.depth.cloud import rays, used_pixels
from stack.types import Block, DepthImage, FloatArray

OFF = 0.04
"""Metres by which a block may be beside its place; farther ones are others."""

BAND = 0.004
"""Metres above and below the level of the top."""

LEAST_POINTS = 60

FITS = 0.012
"""Metres by which the sides of what is seen may differ from those of the block."""


def look_closer(block: Block, depth: DepthImage, base_from_link: FloatArray) -> Block | None:
    """Return a block where a picture shows its top; None if the picture does not show it whole.

    Args:
        block: in the arm's base link.
        depth: taken from above it.
        base_from_link: (4, 4) pose of the base link in the base frame.
    """
    distances = used_pixels(depth)
    measured = (distances >= depth.range_min) & (distances <= depth.range_max)
    points = distances[measured, None] * rays(depth.camera)[measured]
    link_from_base = inverse(base_from_link)
    points = (points + depth.camera.position) @ link_from_base[:3, :3].T + link_from_base[:3, 3]
    middle, height = block.pose[:3, 3], float(block.size[2])
    reach = float(np.hypot(*block.size[:2])) / 2.0 + OFF
    near = np.hypot(*(points[:, :2] - middle[:2]).T) < reach
    above = points[:, 2] - middle[2]
    found = points[near & (above > 0.0) & (above < height / 2.0 + OFF)]
    if len(found) < LEAST_POINTS:
        return None
    level = float(np.median(found[:, 2]))
    top = found[np.abs(found[:, 2] - level) < BAND]
    centre, sides, _ = cv2.minAreaRect(top[:, :2].astype(np.float32))
    if np.abs(np.sort(sides) - np.sort(block.size[:2])).max() > FITS:
        return None
    pose = block.pose.copy()
    pose[:3, 3] = *centre, level - height / 2.0
    return replace(block, pose=pose, stamp=depth.stamp)
