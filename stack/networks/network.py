"""Networks from ONNX files, run by OpenCV."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from stack.errors import InputError
from stack.networks.onnx_file import OnnxHeader

LONGEST_REASON = 160
"""Characters of a reason that OpenCV gives."""

Array = NDArray[np.float32]


class Network:
    """A network that OpenCV runs. Not for two threads at once.

    Args:
        file: ONNX.
        header: of the file.

    Raises:
        InputError: OpenCV cannot load it.
    """

    def __init__(self, file: Path, header: OnnxHeader) -> None:
        self.file = file
        self._inputs = [tensor.name for tensor in header.inputs]
        try:
            with _silent():
                self._net = cv2.dnn.readNetFromONNX(str(file))
                self._outputs = list(self._net.getUnconnectedOutLayersNames())
        except cv2.error as error:
            raise InputError(f"{file} cannot be loaded by OpenCV: {_reason_of(error)}") from None

    def run(self, inputs: Mapping[str, Array]) -> list[Array]:
        """Return the outputs for inputs by name."""
        for name in self._inputs:
            self._net.setInput(inputs[name], name)
        return [np.asarray(output, np.float32) for output in self._net.forward(self._outputs)]

    def tried(self, inputs: Mapping[str, Array], what: str, remedy: str) -> list[Array]:
        """Return the outputs for first inputs.

        Args:
            inputs: by name.
            what: the inputs in the message.
            remedy: what to do if the network does not run on them.

        Raises:
            InputError: the network does not run on them.
        """
        try:
            with _silent():
                return self.run(inputs)
        except cv2.error as error:
            raise InputError(
                f"{self.file} does not run on {what}: {_reason_of(error)}; {remedy}"
            ) from None


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
