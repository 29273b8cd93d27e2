"""Pixels of a colour: by hue, saturation and brightness (HSV), so that dim light changes little."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

HUES = {"red": 0.0, "yellow": 60.0, "green": 120.0, "blue": 240.0}
"""Degrees."""


def has_hue(
    pixels: NDArray[np.uint8], colour: str, tolerance: float, saturation: float, value: float
) -> NDArray[np.bool_]:
    """Return (height, width) which pixels have the hue of a colour.

    Args:
        pixels: (height, width, 3) RGB.
        colour: a key of HUES.
        tolerance: largest difference from its hue, degrees.
        saturation: least share of the brightest channel.
        value: least brightness of a pixel that has a hue, grey levels.
    """
    hsv = cv2.cvtColor(pixels.astype(np.float32), cv2.COLOR_RGB2HSV)
    away = np.abs((hsv[..., 0] - np.float32(HUES[colour]) + 180.0) % 360.0 - 180.0)
    found: NDArray[np.bool_] = (
        (away <= tolerance) & (hsv[..., 1] >= saturation) & (hsv[..., 2] >= value)
    )
    return found
