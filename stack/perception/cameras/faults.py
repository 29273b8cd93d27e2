"""Faults of single pictures: what is wrong with it, as a word and a sentence."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from stack.types import CameraModel, DepthImage, Image

SAMPLED = 16
"""Rows and columns between the pixels that are compared first."""


class Fault(NamedTuple):
    """What is wrong with a camera's pictures.

    Attributes:
        word: size | type | stamp | late | invalid | uniform | frozen | silent.
        text: what it delivers and what is expected, continuing "the camera NAME …".
        is_usable: whether the picture may be used nevertheless.
    """

    word: str
    text: str
    is_usable: bool = False


def fault_of(picture: Image | DepthImage, model: CameraModel, least_valid: float) -> Fault | None:
    """Return the fault of a picture's content; None if it can be used.

    Args:
        picture: as the body delivers it.
        model: of the camera in the robot file.
        least_valid: share of the pixels of a depth picture with a distance within range.
    """
    if isinstance(picture, DepthImage):
        return _depth_fault(picture, model, least_valid)
    fault = _shape_fault(picture.pixels, (model.height, model.width, 3), np.uint8)
    if fault is not None:
        return fault
    first = picture.pixels[0, 0]
    few = picture.pixels[::SAMPLED, ::SAMPLED]
    if (few == first).all() and (picture.pixels == first).all():
        colour = ", ".join(map(str, first))
        text = f"delivers pictures of one colour ({colour}); it may be covered"
        return Fault("uniform", text, is_usable=True)
    return None


def _depth_fault(picture: DepthImage, model: CameraModel, least_valid: float) -> Fault | None:
    fault = _shape_fault(picture.depth, (model.height, model.width), np.float32)
    if fault is not None:
        return fault
    near, far = picture.range_min, picture.range_max
    valid = np.count_nonzero((picture.depth >= near) & (picture.depth <= far)) / picture.depth.size
    if valid < least_valid:
        text = (
            f"measures distances of {near:g} to {far:g} m in {valid:.1%} of its pixels;"
            f" expected {least_valid:.1%}"
        )
        return Fault("invalid", text)
    return None


def _shape_fault(array: object, shape: tuple[int, ...], kind: type) -> Fault | None:
    if not isinstance(array, np.ndarray) or array.dtype != kind:
        found = array.dtype if isinstance(array, np.ndarray) else type(array).__name__
        return Fault("type", f"delivers pixels of type {found}; expected {np.dtype(kind)}")
    if array.shape != shape:
        found, expected = (" x ".join(map(str, size)) for size in (array.shape, shape))
        return Fault("size", f"delivers pictures of {found} values; expected {expected}")
    return None
