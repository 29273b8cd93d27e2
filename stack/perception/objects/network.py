"""Networks whose input is a picture."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stack.errors import InputError
from stack.networks.network import Network
from stack.networks.onnx_file import OnnxHeader, read_header


class PictureNetwork:
    """A network whose one input is a picture. Not for two threads at once.

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
        self._setting, self.metadata = setting, header.metadata
        self.size = _picture_size(file, header, side)
        self._input = header.inputs[0].name
        self._network = Network(file, header)

    def run(self, blob: NDArray[np.float32]) -> list[NDArray[np.float32]]:
        """Return the outputs for an input (1, 3, height, width)."""
        return self._network.run({self._input: blob})

    def tried(self, blob: NDArray[np.float32]) -> list[NDArray[np.float32]]:
        """Return the outputs for a first input.

        Raises:
            InputError: the network does not run on it.
        """
        size = f"an input of {self.size[0]} x {self.size[1]} pixels"
        remedy = f"set `{self._setting}` to the size of the export"
        return self._network.tried({self._input: blob}, size, remedy)


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
