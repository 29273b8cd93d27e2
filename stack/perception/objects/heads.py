"""Pictures to model inputs, and outputs of YOLO heads to boxes.

Three layouts are known, by their shape; C is the number of classes and n that of candidates:

* (1, n, 5 + C): centre, size, objectness, class scores (YOLOv5, v7);
* (1, 4 + C, n) or (1, n, 4 + C): centre, size, class scores (YOLOv8, v9, v11);
* (1, n, 6): corners, score, class number; without duplicates (YOLOv10 and other end-to-end heads).

Coordinates are pixels of the model's input.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from stack.types import FloatArray

GREY = 114
"""Of the border around a picture; models are trained with it."""

LEAST_SIDE = 2.0
"""Pixels; smaller boxes are ignored."""


@dataclass(frozen=True, slots=True)
class LetterBox:
    """Placement of a picture in a model's input.

    Attributes:
        scale: pixels of the input per pixel of the picture.
        left: width of the border, pixels of the input.
        top: height of the border, likewise.
    """

    scale: float
    left: int
    top: int


@dataclass(frozen=True, slots=True)
class Box:
    """An object in a picture.

    Attributes:
        label: number of its class.
        score: in [0, 1].
        corners: left, top, right, bottom, pixels of the picture.
    """

    label: int
    score: float
    corners: tuple[float, float, float, float]


def letterboxed(
    pixels: NDArray[np.uint8], size: tuple[int, int]
) -> tuple[NDArray[np.float32], LetterBox]:
    """Return a model's input (1, 3, height, width) of RGB in [0, 1], and the picture's place in it.

    The picture keeps its proportions; a grey border fills the rest.

    Args:
        pixels: (rows, columns, 3) uint8 RGB.
        size: height and width of the input.
    """
    (rows, columns), (height, width) = pixels.shape[:2], size
    scale = min(height / rows, width / columns)
    down, across = max(1, round(rows * scale)), max(1, round(columns * scale))
    shrunk = cv2.resize(pixels, (across, down), interpolation=cv2.INTER_LINEAR)
    top, left = (height - down) // 2, (width - across) // 2
    canvas = np.full((height, width, 3), GREY, np.uint8)
    canvas[top : top + down, left : left + across] = shrunk
    blob = np.ascontiguousarray(canvas.transpose(2, 0, 1)[None], dtype=np.float32)
    return blob / np.float32(255.0), LetterBox(scale, left, top)


def layout_of(shape: tuple[int, ...], classes: int) -> str:
    """Return the layout of an output: objectness, transposed, plain or final; "" for others."""
    if len(shape) != 3 or shape[0] != 1:
        return ""
    if shape[2] == 5 + classes:
        return "objectness"
    if shape[1] == 4 + classes:
        return "transposed"
    if shape[2] == 4 + classes:
        return "plain"
    return "final" if shape[2] == 6 else ""


def decoded(
    output: NDArray[np.float32], layout: str, threshold: float
) -> tuple[FloatArray, FloatArray, NDArray[np.int64]]:
    """Return boxes (m, 4) as corners, scores (m,) and classes (m,) above a threshold.

    Args:
        output: of the model, in one of the layouts.
        layout: as `layout_of`.
        threshold: least score.
    """
    rows = (output[0].T if layout == "transposed" else output[0]).astype(np.float64)
    rows = rows[np.isfinite(rows).all(axis=1)]
    if layout == "final":
        corners, scores, labels = rows[:, :4], rows[:, 4], rows[:, 5].astype(np.int64)
    else:
        first = 5 if layout == "objectness" else 4
        labels = rows[:, first:].argmax(axis=1)
        scores = rows[np.arange(len(rows)), first + labels]
        if layout == "objectness":
            scores = scores * rows[:, 4]
        half = rows[:, 2:4] / 2.0
        corners = np.hstack([rows[:, :2] - half, rows[:, :2] + half])
    good = scores >= threshold
    return corners[good], np.minimum(scores[good], 1.0), labels[good]


def boxes_of(  # noqa: PLR0913 - the output and how to read it
    output: NDArray[np.float32], layout: str, place: LetterBox, shape: tuple[int, int],
    threshold: float, overlap: float,
) -> list[Box]:  # fmt: skip
    """Return the objects in a picture, the most certain first.

    Args:
        output: of the model.
        layout: as `layout_of`.
        place: of the picture in the model's input.
        shape: rows and columns of the picture.
        threshold: least score.
        overlap: intersection over union above which two boxes of a class are one object.
    """
    corners, scores, labels = decoded(output, layout, threshold)
    corners = (corners - [place.left, place.top] * 2) / place.scale
    corners = np.clip(corners, 0.0, [shape[1], shape[0]] * 2)
    sides = corners[:, 2:] - corners[:, :2]
    good = (sides >= LEAST_SIDE).all(axis=1)
    corners, sides, scores, labels = corners[good], sides[good], scores[good], labels[good]
    if not len(corners):
        return []
    kept = cv2.dnn.NMSBoxesBatched(
        np.hstack([corners[:, :2], sides]).tolist(), scores.tolist(), labels.tolist(),
        threshold, overlap,
    )  # fmt: skip
    order = sorted((int(n) for n in kept), key=lambda n: (-scores[n], n))
    return [Box(int(labels[n]), float(scores[n]), _corners(corners[n])) for n in order]


def _corners(row: FloatArray) -> tuple[float, float, float, float]:
    left, top, right, bottom = (float(value) for value in row)
    return left, top, right, bottom
