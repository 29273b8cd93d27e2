"""Picture files of a calibration: read for it, and drawn to judge it by eye."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from stack.documents.files import IMAGE_BYTES, read_input
from stack.errors import InputError
from stack.perception.camera.board import BoardView
from stack.perception.camera.calibration import GRID, Calibration

SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".pgm", ".ppm", ".tif", ".tiff", ".webp")
"""Names of pictures in a folder."""

_GOOD, _BAD, _LINE = (90, 200, 90), (60, 60, 230), (200, 200, 200)
"""Blue, green, red."""


def picture_files(named: Sequence[Path]) -> list[Path]:
    """Return the picture files, those of a folder in place of the folder, each once.

    Raises:
        InputError: a folder has no pictures.
    """
    found: list[Path] = []
    for path in named:
        if not path.is_dir():
            found.append(path)
            continue
        inside = sorted(item for item in path.iterdir() if item.suffix.lower() in SUFFIXES)
        if not inside:
            raise InputError(f"{path}: the folder has no pictures ({', '.join(SUFFIXES)})")
        found += inside
    return list(dict.fromkeys(found))


def read_grey(path: Path) -> NDArray[np.uint8]:
    """Return the brightness (height, width) of a picture file.

    A turned picture of a phone stays as the sensor has taken it.

    Raises:
        InputError: the file cannot be read, or is not a picture.
    """
    content = np.frombuffer(read_input(path, "picture", IMAGE_BYTES), dtype=np.uint8)
    flags = cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION
    try:
        picture = cv2.imdecode(content, flags) if content.size else None
    except cv2.error:
        picture = None
    if picture is None:
        raise InputError(f"{path} is not a picture that OpenCV can read (PNG, JPEG, …)")
    grey: NDArray[np.uint8] = np.asarray(picture, dtype=np.uint8)
    return grey


def overview(
    grey: NDArray[np.uint8], views: Sequence[BoardView], result: Calibration
) -> NDArray[np.uint8]:
    """Return a picture (height, 2 * width, 3), BGR, to judge a calibration by.

    On the left all corners of all views, red where the error is above three times the mean, and the
    grid in which they are counted; on the right the first picture without its distortion.

    Args:
        grey: the first picture.
        views: as calibrated.
        result: of the calibration.
    """
    camera = result.camera
    left = cv2.cvtColor((grey // 3).astype(np.uint8), cv2.COLOR_GRAY2BGR)
    for row in range(1, GRID[0]):
        at = row * camera.height // GRID[0]
        cv2.line(left, (0, at), (camera.width, at), (90, 90, 90), 1)
    for column in range(1, GRID[1]):
        at = column * camera.width // GRID[1]
        cv2.line(left, (at, 0), (at, camera.height), (90, 90, 90), 1)
    radius = max(2, camera.width // 250)
    for view, residuals in zip(views, result.residuals, strict=True):
        for corner, residual in zip(view.corners, residuals, strict=True):
            bad = float(np.linalg.norm(residual)) > 3.0 * result.rms
            centre = int(corner[0]), int(corner[1])
            cv2.circle(left, centre, radius, _BAD if bad else _GOOD, -1, cv2.LINE_AA)
    rectified = cv2.remap(grey, *camera.rectifying_maps(), cv2.INTER_LINEAR)
    right = cv2.cvtColor(rectified, cv2.COLOR_GRAY2BGR)
    cv2.line(right, (0, 0), (0, camera.height), _LINE, 2)
    both: NDArray[np.uint8] = np.hstack([left, right]).astype(np.uint8)
    return both
