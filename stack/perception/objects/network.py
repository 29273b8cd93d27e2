"""Networks from ONNX files, run by OpenCV."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from stack.errors import InputError
from stack.perception.objects.onnx_file import OnnxHeader, read_header

LONGEST_REASON = 160
"""Characters of a reason that OpenCV gives."""


class PictureNetwork:
    """A network whose one input is a picture, run by OpenCV. Not for two threads at once.

    Attributes:
        size: height and width of the input, pixels.
        metadata: in the file.
    """

    def __init__(self, file: Path, side: int, setting: str) -> None:
        """Load a network.

        Args:
            file: ONNX.
            side: of the input in pixels, where the file leaves it open.
            setting: name of the parameter that sets this side.

        Raises:
            InputError: it is no ONNX file, has other inputs, or OpenCV cannot load it.
        """
        header = read_header(file)
        self._file, self._setting, self.metadata = file, setting, header.metadata
        self.size = _picture_size(file, header, side)
        try:
            with _silent():
                self._net = cv2.dnn.readNetFromONNX(str(file))
                self._outputs = list(self._net.getUnconnectedOutLayersNames())
        except cv2.error as error:
            raise InputError(f"{file} cannot be loaded by OpenCV: {_reason_of(error)}") from None

    def run(self, blob: NDArray[np.float32]) -> list[NDArray[np.float32]]:
        """Return the outputs for an input (1, 3, height, width)."""
        self._net.setInput(blob)
        return [np.asarray(output, np.float32) for output in self._net.forward(self._outputs)]

    def tried(self, blob: NDArray[np.float32]) -> list[NDArray[np.float32]]:
        """Return the outputs for a first input.

        Raises:
            InputError: the network does not run on it.
        """
        try:
            with _silent():
                return self.run(blob)
        except cv2.error as error:
            size = f"{self.size[0]} x {self.size[1]}"
            raise InputError(
                f"{self._file} does not run on an input of {size} pixels: {_reason_of(error)}; set "
                f"`{self._setting}` to the size of the export"
            ) from None


def _picture_size(file: Path, header: OnnxHeader, default: int) -> tuple[int, int]:
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


def _reason_of(error: cv2.error) -> str:
    """Return OpenCV's reason without the path of its source file, in one line."""
    text = " ".join(str(error.err or error).split())
    return text if len(text) <= LONGEST_REASON else f"{text[:LONGEST_REASON]}…"


@contextmanager
def _silent() -> Iterator[None]:
    """Keep OpenCV from printing its own errors."""
    before = cv2.utils.logging.getLogLevel()
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
    try:
        yield
    finally:
        cv2.utils.logging.setLogLevel(before)
