"""Global descriptor of pictures: an ONNX model of the user's that OpenCV runs.

Networks for place recognition (R. Arandjelović et al., "NetVLAD", CVPR 2016, and what followed)
map a picture to one vector, so that pictures of one place have similar vectors. The cosine of two
vectors is the similarity. `python -m stack.perception.places.descriptor` tries a model in a process
of its own: OpenCV can crash on a damaged file.
"""

from __future__ import annotations

import hashlib
import json
import sys
from dataclasses import asdict
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from stack.errors import InputError
from stack.perception.objects.trial import answer_of, version_of
from stack.perception.places.parameters import PlaceParameters

if TYPE_CHECKING:
    from stack.types import FloatArray

MEAN = np.array([0.485, 0.456, 0.406], np.float32)
DEVIATION = np.array([0.229, 0.224, 0.225], np.float32)
"""Of the red, green and blue of ImageNet's pictures, 0 to 1."""

LEAST_LENGTH = 2
"""A vector of one number has no direction."""


class GlobalDescriptor:
    """A model that describes pictures by vectors. Not for two threads at once.

    Attributes:
        digest: of the file and the way its input is prepared; other vectors than those of the same
            digest are not comparable.
        length: of the vectors.
    """

    def __init__(self, parameters: PlaceParameters) -> None:
        """Load a model and try it on a grey picture.

        Raises:
            InputError: the file is no ONNX model, or none that maps a picture to a vector.
        """
        from stack.perception.objects.network import load_network, picture_size
        from stack.perception.objects.onnx_file import read_header

        self._file = Path(parameters.descriptor)
        header = read_header(self._file)
        self._size = picture_size(self._file, header, parameters.descriptor_size)
        self._normalised = parameters.descriptor_normalised
        self._net, self._outputs = load_network(self._file)
        way = f"{self._size} {self._normalised}".encode()
        self.digest = hashlib.sha256(self._file.read_bytes() + way).hexdigest()
        self.length = self._try()

    def describe(self, pixels: NDArray[np.uint8]) -> FloatArray:
        """Return the vector (length,) of a picture, of length 1, or all 0.

        Args:
            pixels: (rows, columns, 3) uint8 RGB; the whole picture is scaled to the model's input.
        """
        vector = self._run(pixels)[0].ravel().astype(np.float64)
        if not np.isfinite(vector).all():
            return np.zeros(len(vector))
        vector /= max(float(np.sqrt((vector * vector).sum())), 1e-12)
        return vector

    def _run(self, pixels: NDArray[np.uint8]) -> list[NDArray[np.float32]]:
        import cv2

        height, width = self._size
        scaled = cv2.resize(pixels, (width, height), interpolation=cv2.INTER_AREA)
        picture = scaled.astype(np.float32) / np.float32(255.0)
        if self._normalised:
            picture = (picture - MEAN) / DEVIATION
        self._net.setInput(np.ascontiguousarray(picture.transpose(2, 0, 1))[None])
        return [np.asarray(output, np.float32) for output in self._net.forward(self._outputs)]

    def _try(self) -> int:
        """Return the length of the vectors."""
        import cv2

        from stack.perception.objects.network import reason_of, silent

        grey = np.full((*self._size, 3), 128, np.uint8)
        try:
            with silent():
                outputs = self._run(grey)
        except cv2.error as error:
            size = f"{self._size[0]} x {self._size[1]}"
            raise InputError(
                f"{self._file} does not run on an input of {size} pixels: {reason_of(error)}; set "
                "`descriptor_size` to the size of the export"
            ) from None
        shapes = [output.shape for output in outputs]
        length: int = max(shapes[0], default=0)
        if len(shapes) > 1 or outputs[0].size != length or length < LEAST_LENGTH:
            got = ", ".join(" x ".join(map(str, shape)) or "one number" for shape in shapes)
            raise InputError(
                f"{self._file} has an output of {got}; a descriptor has one of 1 x n, the vector "
                "of the picture; export the model with its pooling"
            )
        if not np.isfinite(outputs[0]).all():
            raise InputError(
                f"{self._file} gives numbers that are not finite for a grey picture; check "
                "`descriptor_normalised`, or export the model again"
            )
        return length


def load_descriptor(parameters: PlaceParameters) -> GlobalDescriptor | None:
    """Load the model that the parameters name; None if they name none.

    Raises:
        InputError: it cannot be used.
    """
    return GlobalDescriptor(parameters) if parameters.descriptor else None


def checked_digest(parameters: PlaceParameters) -> str:
    """Try the model in another process; return its digest, empty without one.

    Raises:
        InputError: as `GlobalDescriptor`, or the model crashes.
    """
    if not parameters.descriptor:
        return ""
    own = PlaceParameters(
        descriptor=parameters.descriptor, descriptor_size=parameters.descriptor_size,
        descriptor_normalised=parameters.descriptor_normalised,
    )  # fmt: skip
    digest, problem = _tried(own, version_of(Path(own.descriptor)))
    if problem:
        raise InputError(problem)
    return digest


@lru_cache(maxsize=16)
def _tried(parameters: PlaceParameters, version: object) -> tuple[str, str]:
    """Return the digest, or why the model cannot be used."""
    argument = json.dumps(asdict(parameters))
    answer, problem = answer_of(__name__, parameters.descriptor, argument)
    return str(answer or ""), problem


def _main() -> None:
    parameters = PlaceParameters(**json.loads(sys.argv[1]))
    try:
        answer = (GlobalDescriptor(parameters).digest, "")
    except InputError as error:
        answer = ("", str(error))
    print(json.dumps(answer))


if __name__ == "__main__":
    _main()
