"""Pictures for viewers: small enough to be sent while a mission runs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from stack.types import Image

WIDEST = 160
"""Pixels: a terminal of 160 columns shows one pixel in each."""


def small_picture(image: Image) -> Image:
    """Return every n-th pixel of a picture; `camera` remains the model of the whole one."""
    stride = -(-image.pixels.shape[1] // WIDEST)
    return replace(image, pixels=np.ascontiguousarray(image.pixels[::stride, ::stride]))
