"""Pictures of a robot on an endless floor, and what can be wrong with them."""

from __future__ import annotations

from dataclasses import replace
from math import inf, nan
from pathlib import Path

import numpy as np

from robots.load import find_robot, read_robot
from stack.perception.depth.cloud import rays
from stack.types import DepthImage, Image

SCOUT = read_robot(find_robot("scout", Path()))
DEPTH, COLOUR = SCOUT.depth_cameras["depth"], SCOUT.camera


def floor_picture(stamp: float, number: int = 0) -> DepthImage:
    """What scout's depth camera measures of a floor, with 0.5 % noise."""
    rise = rays(DEPTH.model)[:, :, 2]
    with np.errstate(divide="ignore"):
        true = np.where(rise < 0.0, -DEPTH.model.position[2] / rise, inf)
    noise = np.random.default_rng(number).standard_normal(true.shape)
    depth = np.where(true <= DEPTH.range_max, true * (1.0 + 0.005 * noise), inf)
    depth[depth > DEPTH.range_max] = inf
    return DepthImage(
        stamp, depth.astype(np.float32), DEPTH.model, DEPTH.range_min, DEPTH.range_max
    )


def colour_picture(stamp: float, number: int = 0) -> Image:
    """A picture of noise."""
    model = COLOUR.model
    pixels = np.random.default_rng(number).integers(0, 256, (model.height, model.width, 3))
    return Image(stamp, pixels.astype(np.uint8), model)


def _filled(value):
    return lambda array: np.full_like(array, value)


PIXEL_FAULTS = {
    "truncated": (lambda array: array.ravel()[:5000], "size"),
    "half the rows": (lambda array: array[: len(array) // 2], "size"),
    "turned": (lambda array: np.swapaxes(array, 0, 1), "size"),
    "empty": (lambda array: array[:0], "size"),
    "doubles": (lambda array: array.astype(np.float64), "type"),
    "a list": (lambda array: array.tolist(), "type"),
    "nothing": (lambda array: None, "type"),
}
"""Name -> change of the pixels of any picture, and the fault that it is."""

DEPTH_FAULTS = {
    "NaN": (_filled(nan), "invalid"),
    "all zero": (_filled(0.0), "invalid"),
    "negative": (_filled(-1.0), "invalid"),
    "no return": (_filled(inf), "invalid"),
    "minus infinity": (_filled(-inf), "invalid"),
    "millimetres": (lambda depth: 1000.0 * depth, "invalid"),
    "a few pixels": (
        lambda depth: np.where(np.arange(160) < 4, depth, nan).astype(np.float32), "invalid",
    ),
}  # fmt: skip


def broken(picture: Image | DepthImage, change) -> Image | DepthImage:
    """The picture with other pixels."""
    if isinstance(picture, DepthImage):
        return replace(picture, depth=change(picture.depth))
    return replace(picture, pixels=change(picture.pixels))
