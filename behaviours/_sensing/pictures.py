"""Names and quality of pictures."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stack.types import FloatArray, Image

WINDOW = 9
"""Pixels of the mean filter (Crété et al.)."""

FLAT_DEVIATION = 2.0
"""Grey levels; a picture with a smaller standard deviation shows nothing to be sharp."""

LUMINANCE = np.array([0.299, 0.587, 0.114])
"""Shares of red, green and blue (ITU-R BT.601)."""


def picture_name(label: str, stamp: float) -> str:
    """Return the file name of a picture, without its suffix: label and seconds."""
    safe = re.sub(r"[^\w-]+", "_", label)
    return f"{safe}_{stamp:07.2f}s"


@dataclass(frozen=True, slots=True)
class PictureQuality:
    """Quality of a picture.

    Attributes:
        sharpness: in [0, 1]; 0 for a picture that shows nothing.
        brightness: mean grey level in [0, 1].
        contrast: standard deviation of the grey levels, in [0, 1].
    """

    sharpness: float
    brightness: float
    contrast: float


def quality_of(image: Image) -> PictureQuality:
    """Return the quality of a picture."""
    grey: FloatArray = image.pixels.astype(np.float64) @ LUMINANCE
    contrast = float(grey.std())
    sharpness = sharpness_of(grey) if contrast >= FLAT_DEVIATION else 0.0
    return PictureQuality(sharpness, float(grey.mean()) / 255.0, contrast / 255.0)


def sharpness_of(grey: FloatArray) -> float:
    """Return the sharpness of a grey picture (height, width), in [0, 1].

    One minus the blur effect of F. Crété, T. Dolmiere, P. Ladret and M. Nicolas, "The blur effect:
    perception and estimation with a new no-reference perceptual blur metric", SPIE 6492 (2007): a
    mean filter takes much of the differences between neighbouring pixels of a sharp picture, and
    little of those of a blurred one. The result is the same at any brightness and contrast, which
    the variance of the Laplacian is not. Differences along the worse axis count, so that blur by a
    motion is found. Noise counts as sharp detail.
    """
    return min(_sharpness_along(grey), _sharpness_along(grey.T))


def _sharpness_along(grey: FloatArray) -> float:
    """Return the sharpness of the differences along the columns (axis 0)."""
    sums = np.cumsum(np.pad(grey, ((WINDOW // 2 + 1, WINDOW // 2), (0, 0)), mode="edge"), axis=0)
    smooth = (sums[WINDOW:] - sums[:-WINDOW]) / WINDOW
    own, left = _differences(grey), _differences(smooth)
    total = float(own.sum())
    return float(np.maximum(own - left, 0.0).sum()) / total if total > 0.0 else 0.0


def _differences(grey: FloatArray) -> NDArray[np.float64]:
    found: NDArray[np.float64] = np.abs(np.diff(grey, axis=0))
    return found
