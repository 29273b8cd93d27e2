"""Networks from ONNX files, run by OpenCV."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import cv2

from stack.errors import InputError
from stack.perception.objects.onnx_file import OnnxHeader

LONGEST_REASON = 160
"""Characters of a reason that OpenCV gives."""


def picture_size(file: Path, header: OnnxHeader, default: int) -> tuple[int, int]:
    """Return height and width of a model's input, pixels.

    Args:
        file: of the model.
        header: of the file.
        default: side in pixels, where the file leaves it open.

    Raises:
        InputError: the model's input is not one picture.
    """
    if len(header.inputs) != 1:
        names = ", ".join(map(str, header.inputs)) or "none"
        raise InputError(f"{file}: expected a model with one input, a picture; it has {names}")
    shape = header.inputs[0].shape
    if shape and (len(shape) != 4 or shape[0] not in (None, 1) or shape[1] not in (None, 3)):
        raise InputError(
            f"{file}: expected an input of 1 x 3 x height x width, got {header.inputs[0]}"
        )
    height, width = shape[2:] if shape else (None, None)
    return height or default, width or default


def load_network(file: Path) -> tuple[cv2.dnn.Net, list[str]]:
    """Return the network and the names of its outputs.

    Raises:
        InputError: OpenCV cannot load it.
    """
    try:
        with silent():
            net = cv2.dnn.readNetFromONNX(str(file))
            return net, list(net.getUnconnectedOutLayersNames())
    except cv2.error as error:
        raise InputError(f"{file} cannot be loaded by OpenCV: {reason_of(error)}") from None


def reason_of(error: cv2.error) -> str:
    """Return OpenCV's reason without the path of its source file, in one line."""
    text = " ".join(str(error.err or error).split())
    return text if len(text) <= LONGEST_REASON else f"{text[:LONGEST_REASON]}…"


@contextmanager
def silent() -> Iterator[None]:
    """Keep OpenCV from printing its own errors."""
    before = cv2.utils.logging.getLogLevel()
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
    try:
        yield
    finally:
        cv2.utils.logging.setLogLevel(before)
