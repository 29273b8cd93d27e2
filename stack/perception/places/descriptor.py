"""Global descriptor of pictures: an ONNX model of the user's that OpenCV runs.

Networks for place recognition (R. Arandjelović et al., "NetVLAD", CVPR 2016, and what followed)
map a picture to one vector, so that pictures of one place have similar vectors. The cosine of two
vectors is the similarity.
"""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from stack.documents.files import note_input
from stack.errors import InputError
from stack.networks.trial import answer, tried
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
        from stack.perception.objects.network import PictureNetwork  # imports OpenCV

        self._file = Path(parameters.descriptor)
        note_input(self._file)
        side = parameters.descriptor_size
        self._network = PictureNetwork(self._file, side, "descriptor_size")
        self._normalised = parameters.descriptor_normalised
        way = f"{self._network.size} {self._normalised}".encode()
        self.digest = hashlib.sha256(self._file.read_bytes() + way).hexdigest()
        self.length = self._try()

    def describe(self, pixels: NDArray[np.uint8]) -> FloatArray:
        """Return the vector (length,) of a picture, of length 1, or all 0.

        Args:
            pixels: (rows, columns, 3) uint8 RGB; the whole picture is scaled to the model's input.
        """
        vector = self._network.run(self._prepared(pixels))[0].ravel().astype(np.float64)
        if not np.isfinite(vector).all():
            return np.zeros(len(vector))
        vector /= max(float(np.sqrt((vector * vector).sum())), 1e-12)
        return vector

    def _prepared(self, pixels: NDArray[np.uint8]) -> NDArray[np.float32]:
        """Return the network's input (1, 3, height, width) for a picture."""
        import cv2

        height, width = self._network.size
        scaled = cv2.resize(pixels, (width, height), interpolation=cv2.INTER_AREA)
        picture = scaled.astype(np.float32) / np.float32(255.0)
        if self._normalised:
            picture = (picture - MEAN) / DEVIATION
        return np.ascontiguousarray(picture.transpose(2, 0, 1))[None]

    def _try(self) -> int:
        """Return the length of the vectors."""
        grey = np.full((*self._network.size, 3), 128, np.uint8)
        outputs = self._network.tried(self._prepared(grey))
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
    p = parameters
    settings = {
        "descriptor": p.descriptor, "descriptor_size": p.descriptor_size,
        "descriptor_normalised": p.descriptor_normalised,
    }  # fmt: skip
    return str(tried(__name__, settings, [p.descriptor]))


if __name__ == "__main__":
    answer(lambda raw: GlobalDescriptor(PlaceParameters(**raw)).digest)
