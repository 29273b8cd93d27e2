"""Object detector: an ONNX model that OpenCV runs.

OpenCV reads the exports of the usual YOLO versions and gives the same bits with any number of
threads; its results agreed with those of onnxruntime to 2e-4 of a pixel (YOLOv8n, 320 x 320).
"""

from __future__ import annotations

import ast
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from stack.errors import InputError
from stack.perception.objects.heads import Box, boxes_of, layout_of, letterboxed
from stack.perception.objects.network import load_network, picture_size, reason_of, silent
from stack.perception.objects.onnx_file import OnnxHeader, read_header
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
        header = read_header(self._file)
        self._size = picture_size(self._file, header, parameters.input_size)
        self.labels = _labels(self._file, header, parameters)
        self._net, self._outputs = load_network(self._file)
        self._output, self._layout = self._try()

    def boxes(self, pixels: NDArray[np.uint8], threshold: float, overlap: float) -> list[Box]:
        """Return the objects in a picture, the most certain first.

        Args:
            pixels: (rows, columns, 3) uint8 RGB.
            threshold: least score.
            overlap: intersection over union above which two boxes of a class are one object.
        """
        blob, place = letterboxed(pixels, self._size)
        output = self._run(blob)[self._output]
        rows, columns = pixels.shape[:2]
        boxes = boxes_of(output, self._layout, place, (rows, columns), threshold, overlap)
        return [box for box in boxes if 0 <= box.label < len(self.labels)]

    def _run(self, blob: NDArray[np.float32]) -> list[NDArray[np.float32]]:
        self._net.setInput(blob)
        return [np.asarray(output, np.float32) for output in self._net.forward(self._outputs)]

    def _try(self) -> tuple[int, str]:
        """Return number and layout of the first output with the shape of a YOLO head."""
        grey = np.full((1, 3, *self._size), 0.5, np.float32)
        try:
            with silent():
                shapes = [output.shape for output in self._run(grey)]
        except cv2.error as error:
            size = f"{self._size[0]} x {self._size[1]}"
            reason = reason_of(error)
            raise InputError(
                f"{self._file} does not run on an input of {size} pixels: {reason}; set "
                "`input_size` to the size of the export"
            ) from None
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
    file: Path, header: OnnxHeader, parameters: ObjectDetectorParameters
) -> tuple[str, ...]:
    """Return the labels of the parameters, else those in the model's metadata."""
    if parameters.labels:
        return parameters.labels
    if parameters.label_file:
        return _read_labels(Path(parameters.label_file))
    written = header.metadata.get("names", "")
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
    try:
        lines = file.read_text("utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is not UTF-8 text"
        raise InputError(f"label_file: {file} cannot be read: {reason}") from None
    labels = tuple(line.strip() for line in lines if line.strip())
    if not labels:
        raise InputError(f"label_file: {file} has no lines; write a label on each")
    return labels
