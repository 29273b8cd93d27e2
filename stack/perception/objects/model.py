"""Object detector: an ONNX model that OpenCV runs.

OpenCV reads the exports of the usual YOLO versions and gives the same bits with any number of
threads; its results agreed with those of onnxruntime to 2e-4 of a pixel (YOLOv8n, 320 x 320).
"""

from __future__ import annotations

import ast
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stack.documents.files import note_input
from stack.errors import InputError
from stack.networks.trial import answer
from stack.perception.objects.heads import Box, boxes_of, layout_of, letterboxed
from stack.perception.objects.network import PictureNetwork
from stack.perception.objects.parameters import ObjectDetectorParameters


class ObjectModel:
    """A model that finds objects in pictures. Not for two threads at once.

    Attributes:
        labels: of the classes, by number.
    """

    def __init__(self, parameters: ObjectDetectorParameters) -> None:
        """Load a model and try it on a grey picture.

        Raises:
            InputError: the file is no ONNX model, or none of a detector; or its labels are missing.
        """
        self._file = Path(parameters.model)
        self._network = PictureNetwork(self._file, parameters.input_size, "input_size")
        self.labels = _labels(self._file, self._network.metadata, parameters)
        self._output, self._layout = self._head()

    def boxes(self, pixels: NDArray[np.uint8], threshold: float, overlap: float) -> list[Box]:
        """Return the objects in a picture, the most certain first.

        Args:
            pixels: (rows, columns, 3) uint8 RGB.
            threshold: least score.
            overlap: intersection over union above which two boxes of a class are one object.
        """
        blob, place = letterboxed(pixels, self._network.size)
        output = self._network.run(blob)[self._output]
        rows, columns = pixels.shape[:2]
        boxes = boxes_of(output, self._layout, place, (rows, columns), threshold, overlap)
        return [box for box in boxes if 0 <= box.label < len(self.labels)]

    def _head(self) -> tuple[int, str]:
        """Return number and layout of the first output with the shape of a YOLO head."""
        grey = np.full((1, 3, *self._network.size), 0.5, np.float32)
        shapes = [output.shape for output in self._network.tried(grey)]
        classes = len(self.labels)
        for number, shape in enumerate(shapes):
            layout = layout_of(shape, classes)
            if layout:
                return number, layout
        got = ", ".join(" x ".join(map(str, shape)) for shape in shapes)
        raise InputError(
            f"{self._file} has an output of {got}; with {classes} labels a YOLO head has "
            f"1 x n x {5 + classes} or 1 x {4 + classes} x n, and an end-to-end head 1 x n x 6; "
            "check `labels`, or export a detector"
        )


def _labels(
    file: Path, metadata: Mapping[str, str], parameters: ObjectDetectorParameters
) -> tuple[str, ...]:
    """Return the labels of the parameters, else those in the model's metadata."""
    if parameters.labels:
        return parameters.labels
    if parameters.label_file:
        return _read_labels(Path(parameters.label_file))
    written = metadata.get("names", "")
    try:
        names = ast.literal_eval(written) if written else None
    except (ValueError, SyntaxError, MemoryError, RecursionError):
        names = None
    if isinstance(names, dict):
        names = [names.get(number) for number in range(len(names))]
    if isinstance(names, list) and names and all(isinstance(name, str) for name in names):
        return tuple(names)
    raise InputError(
        f"{file} does not state the names of its classes; list them: `labels: [person, chair]`, or "
        "name a text file: `label_file: FILE`"
    )


def _read_labels(file: Path) -> tuple[str, ...]:
    note_input(file)
    try:
        lines = file.read_text("utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is not UTF-8 text"
        raise InputError(f"label_file: {file} cannot be read: {reason}") from None
    labels = tuple(line.strip() for line in lines if line.strip())
    if not labels:
        raise InputError(f"label_file: {file} has no lines; write a label on each")
    return labels


if __name__ == "__main__":
    answer(lambda raw: ObjectModel(ObjectDetectorParameters(**raw)).labels)
