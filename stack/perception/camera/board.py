"""ChArUco board: a chessboard with markers in its white squares, to print and to find in pictures.

The markers number the corners, so a board may be seen in part, and corners near the border of a
picture count as well (S. Garrido-Jurado et al., "Automatic generation and detection of highly
reliable fiducial markers under occlusion", Pattern Recognition 47, 2014).
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from stack.errors import ParameterError
from stack.parameters import parameter, suggestion
from stack.types import FloatArray
from stack.types.marker_dictionaries import marker_dictionaries

LEAST_CORNERS = 8
"""Corners that a picture needs to be used; four would fix a pose, with no check of its errors."""

LEAST_EXTENT = 0.15
"""Smaller side of the found corners as a share of the larger one: below, they are on one line."""


@dataclass(frozen=True)
class BoardParameters:
    """A ChArUco board."""

    columns: int = parameter(7, at_least=3, at_most=60, help="squares along the rows")
    rows: int = parameter(5, at_least=3, at_most=60, help="squares along the columns")
    square: float = parameter(0.03, "m", above=0.0, at_most=2.0, help="side of a square")
    marker: float = parameter(0.022, "m", above=0.0, at_most=2.0, help="side of a marker")
    dictionary: str = parameter("DICT_4X4_50", help="OpenCV's name of the marker dictionary")
    legacy: bool = parameter(
        False, help="pattern of OpenCV before 4.6, which differs for even numbers of rows"
    )

    def __str__(self) -> str:
        return (
            f"{self.columns} x {self.rows} squares of {1000 * self.square:g} mm with markers of "
            f"{1000 * self.marker:g} mm of {self.dictionary}"
        )


@dataclass(frozen=True, slots=True)
class BoardView:
    """The board in one picture.

    Attributes:
        corners: (n, 2) pixels, from the picture's corner.
        points: (n, 3) the same corners on the board, metres.
        rejected: why the picture cannot be used; empty if it can.
    """

    corners: FloatArray
    points: FloatArray
    rejected: str = ""


class Board:
    """Finds and draws a board.

    Raises:
        ParameterError: there is no such dictionary, it has too few markers, or the markers are not
            smaller than the squares.
    """

    def __init__(self, parameters: BoardParameters) -> None:
        p = self.parameters = parameters
        dictionary = _dictionary(p.dictionary)
        if p.marker >= p.square:
            sentence = f"{p.marker:g} m must be below the square's side of {p.square:g} m"
            raise ParameterError("marker", sentence)
        available, needed = len(dictionary.bytesList), p.columns * p.rows // 2
        if needed > available:
            sentence = f"{p.columns} x {p.rows} squares need {needed} markers, {p.dictionary} has "
            hint = "use fewer squares or a larger dictionary, such as DICT_4X4_250"
            raise ParameterError("squares", f"{sentence}{available}; {hint}", hint)
        self._board = cv2.aruco.CharucoBoard((p.columns, p.rows), p.square, p.marker, dictionary)
        self._board.setLegacyPattern(p.legacy)
        self._detector = cv2.aruco.CharucoDetector(self._board)

    @property
    def corner_count(self) -> int:
        """Number of inner corners."""
        return (self.parameters.columns - 1) * (self.parameters.rows - 1)

    def find(self, grey: NDArray[np.uint8]) -> BoardView:
        """Find the board's corners in a picture.

        Args:
            grey: (height, width) brightness.
        """
        corners, numbers, _, markers = self._detector.detectBoard(grey)
        if corners is None or numbers is None:
            return BoardView(np.empty((0, 2)), np.empty((0, 3)), self._no_corners(markers))
        # OpenCV's origin is the centre of the first pixel, the camera model's origin is its corner.
        seen = np.reshape(corners, (-1, 2)).astype(np.float64) + 0.5
        points = np.asarray(self._board.getChessboardCorners(), dtype=np.float64)[np.ravel(numbers)]
        return BoardView(seen, points, _problem(points))

    def _no_corners(self, markers: Any) -> str:
        count = 0 if markers is None else len(markers)
        if count < 2:
            return f"no board: {count or 'no'} marker{'' if count else 's'} of {self._dictionary}"
        return (
            f"{count} markers of {self._dictionary}, but no corners of a board of "
            f"{self.parameters.columns} x {self.parameters.rows} squares (other squares, or an "
            "older pattern: --legacy?)"
        )

    @property
    def _dictionary(self) -> str:
        return self.parameters.dictionary

    def drawn(self, dots_per_metre: float) -> NDArray[np.uint8]:
        """Return a picture of the board (height, width) with a margin of half a square.

        Args:
            dots_per_metre: resolution.
        """
        p, side = self.parameters, max(8, round(self.parameters.square * dots_per_metre))
        margin = side // 2
        size = (p.columns * side + 2 * margin, p.rows * side + 2 * margin)
        return np.asarray(self._board.generateImage(size, None, margin, 1), dtype=np.uint8)


def _dictionary(name: str) -> Any:
    known = marker_dictionaries()
    if name not in known:
        hint = suggestion(name, known)
        raise ParameterError("dictionary", f"there is no dictionary {name!r}; {hint}", hint)
    return cv2.aruco.getPredefinedDictionary(known[name])


def _problem(points: FloatArray) -> str:
    """Return why the found corners are not enough; empty if they are."""
    if len(points) < LEAST_CORNERS:
        return f"only {len(points)} corners; at least {LEAST_CORNERS} are needed"
    spread = np.linalg.svd(points[:, :2] - points[:, :2].mean(axis=0), compute_uv=False)
    if spread[1] < LEAST_EXTENT * spread[0]:
        return f"all {len(points)} corners are nearly on one line"
    return ""


def encoded(picture: NDArray[np.uint8]) -> bytes:
    """Return a PNG file of a picture, grey or BGR."""
    return cv2.imencode(".png", picture)[1].tobytes()


def png(picture: NDArray[np.uint8], dots_per_metre: float) -> bytes:
    """Return a PNG file that says how large the picture is to be printed (its chunk pHYs)."""
    plain, per_metre = encoded(picture), round(dots_per_metre)
    body = b"pHYs" + struct.pack(">IIB", per_metre, per_metre, 1)
    chunk = struct.pack(">I", 9) + body + struct.pack(">I", zlib.crc32(body))
    header = 8 + 25  # signature, and the chunk IHDR
    return plain[:header] + chunk + plain[header:]
