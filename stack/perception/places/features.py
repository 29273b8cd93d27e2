"""Features of a picture (SIFT), and their matches with those of another picture."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stack.types import FloatArray, Image

Descriptors = NDArray[np.uint8]
"""(n, 128) SIFT descriptors. Distances of whole numbers are exact on every processor."""

LEAST_CONTRAST = 0.03
RATIO = 0.8
"""Largest ratio of the distances to the nearest and the second nearest descriptor (Lowe, 2004)."""


@dataclass(frozen=True, slots=True)
class Features:
    """Features of a picture.

    Attributes:
        pixels: (n, 2) from the corner of the image without its distortion, where the first pixel's
            centre is (0.5, 0.5).
        descriptors: (n, 128).
    """

    pixels: FloatArray
    descriptors: Descriptors


def detect(image: Image) -> Features:
    """Return the SIFT features of a picture, those with the strongest contrast first.

    D. Lowe, "Distinctive Image Features from Scale-Invariant Keypoints", IJCV 60, 2004. A point
    with two orientations counts as two features.
    """
    import cv2

    grey = cv2.cvtColor(image.pixels, cv2.COLOR_RGB2GRAY)
    keypoints, descriptors = _detector().detectAndCompute(grey, None)
    if descriptors is None or not keypoints:
        return Features(np.zeros((0, 2)), np.zeros((0, 128), np.uint8))
    # OpenCV's origin is the centre of the first pixel.
    pixels = np.array([keypoint.pt for keypoint in keypoints], dtype=np.float64) + 0.5
    pixels = image.camera.undistort_points(pixels)
    order = np.argsort([-keypoint.response for keypoint in keypoints], kind="stable")
    return Features(pixels[order], np.rint(descriptors).astype(np.uint8)[order])


@cache
def _detector() -> Any:
    import cv2

    return cv2.SIFT.create(contrastThreshold=LEAST_CONTRAST)


def squared_distances(one: Descriptors, other: Descriptors) -> NDArray[np.int64]:
    """Return (n, m) the exact squared distances of descriptors (n, 128) and (m, 128)."""
    squares = [(each.astype(np.int64) ** 2).sum(axis=1) for each in (one, other)]
    # Products of whole numbers below 2^24 are exact in float32 whatever the order of the sum.
    products = (one.astype(np.float32) @ other.astype(np.float32).T).astype(np.int64)
    found: NDArray[np.int64] = squares[0][:, None] + squares[1][None, :] - 2 * products
    return found


def matches(query: Descriptors, known: Descriptors) -> NDArray[np.intp]:
    """Return pairs (m, 2) of a query's and a known descriptor that belong together.

    A pair passes the ratio test, and no known descriptor belongs to two of the query.
    """
    if len(query) == 0 or len(known) < 2:
        return np.zeros((0, 2), np.intp)
    squares = squared_distances(query, known)
    nearest = np.argpartition(squares, 1, axis=1)[:, :2]
    two = np.take_along_axis(squares, nearest, axis=1)
    order = np.argsort(two, axis=1, kind="stable")
    nearest = np.take_along_axis(nearest, order, axis=1)
    two = np.take_along_axis(two, order, axis=1)
    distinct = np.flatnonzero(two[:, 0] < RATIO * RATIO * two[:, 1])
    distinct = distinct[np.argsort(two[distinct, 0], kind="stable")]
    _, first = np.unique(nearest[distinct, 0], return_index=True)
    kept = distinct[np.sort(first)]
    return np.column_stack([kept, nearest[kept, 0]])
