"""Where a costmap lies: over a map, or in a window that rolls with the robot."""

from __future__ import annotations

from stack.costmap.layer import Frame
from stack.errors import ParameterError
from stack.types import OccupancyGrid, Pose2D


class Lattice:
    """Places a costmap's frame so that its cells lie on the map's, or on multiples of their side.

    Args:
        static: the map, or None.
        window: side of a rolling square in metres, or None to cover the map.
        resolution: side of a window's cells, metres; without a window they are the map's.
        near: (x, y) that a window's corner is to be near, metres.

    Raises:
        ParameterError: neither a map nor a window, or a window below three cells.
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
        """Where the cells lie now."""
        (row, column), (x, y), step = self._corner, self._start, self._resolution
        return Frame(self._shape, step, (x + column * step, y + row * step))

    def follow(self, pose: Pose2D) -> tuple[int, int]:
        """Roll the window so that the robot is in its middle; rows and columns that it moved."""
        if not self._rolls:
            return 0, 0
        half = self._shape[0] * self._resolution / 2
        row, column = self._corner
        self._corner = self._corner_near(pose.x - half, pose.y - half)
        return self._corner[0] - row, self._corner[1] - column

    def _corner_near(self, x: float, y: float) -> tuple[int, int]:
        """Row and column on the lattice of the cell corner nearest to a point."""
        left, low = self._start
        return round((y - low) / self._resolution), round((x - left) / self._resolution)
