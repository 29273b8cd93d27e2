"""Lines on the floor, as cells around the robot."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from stack.types.geometry import FloatArray

LineColour = Literal["dark", "light", "red", "yellow", "green", "blue"]
LINE_COLOURS: tuple[str, ...] = get_args(LineColour)
"""Colours of lines that cameras are asked for; dark and light are relative to the floor."""


@dataclass(frozen=True, slots=True)
class FloorLines:
    """Lines on the floor around the robot, from the pictures of the last metres.

    Attributes:
        stamp: of the newest picture, seconds on the body's clock.
        marked: (rows, columns) bool, cells with a line. Row 0 has the lowest y.
        seen: (rows, columns) bool, cells that a picture has shown.
        corner: x and y of the outer corner of the first cell, odom frame, metres.
        cell: side of a cell, metres.
    """

    stamp: float
    marked: NDArray[np.bool_]
    seen: NDArray[np.bool_]
    corner: tuple[float, float]
    cell: float

    def points(self, cells: NDArray[np.int64]) -> FloatArray:
        """Return the centres (n, 2) of cells (n, 2) row and column: odom frame, metres."""
        points: FloatArray = self.cell * (cells[:, ::-1] + 0.5) + np.array(self.corner)
        return points
