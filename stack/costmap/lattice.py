"""Position of a costmap's cells: over the map, or in a window that rolls with the robot."""

from __future__ import annotations

from stack.costmap.layer import Frame
from stack.errors import ParameterError
from stack.types import OccupancyGrid, Pose2D


class Lattice:
    """Aligns a costmap's cells to those of the map, or to multiples of the resolution.

    Args:
        static: the map, or None.
        window: side of a rolling square in metres, or None to cover the map.
        resolution: side of a window's cells, metres; without a window the map's is used.
        near: (x, y) wanted for the window's corner, metres; rounded to a cell.

    Raises:
        ParameterError: neither a map nor a window, or a window of less than three cells.
    """

    def __init__(
        self, static: OccupancyGrid | None, window: float | None, resolution: float,
        near: tuple[float, float],
    ) -> None:  # fmt: skip
        self._rolls = window is not None
        self._start = (0.0, 0.0) if static is None else static.origin
        if window is not None:
            self._resolution = resolution
            side = round(window / resolution)
            if side < 3:
                raise ParameterError(
                    "window", f"{window:g} m is less than three cells of {resolution:g} m"
                )
            self._shape = (side, side)
            self._corner = self._corner_near(*near)
        elif static is not None:
            rows, columns = static.cells.shape
            self._resolution, self._shape, self._corner = static.resolution, (rows, columns), (0, 0)
        else:
            raise ParameterError("window", "a costmap without a map needs a window, e.g. 5 m")

    @property
    def frame(self) -> Frame:
        """Current position of the cells."""
        (row, column), (x, y), step = self._corner, self._start, self._resolution
        return Frame(self._shape, step, (x + column * step, y + row * step))

    def follow(self, pose: Pose2D) -> tuple[int, int]:
        """Centre the window on the robot; return the rows and columns by which it moved."""
        if not self._rolls:
            return 0, 0
        half = self._shape[0] * self._resolution / 2
        row, column = self._corner
        self._corner = self._corner_near(pose.x - half, pose.y - half)
        return self._corner[0] - row, self._corner[1] - column

    def _corner_near(self, x: float, y: float) -> tuple[int, int]:
        """Row and column of the cell corner nearest to a point, metres."""
        left, low = self._start
        return round((y - low) / self._resolution), round((x - left) / self._resolution)
