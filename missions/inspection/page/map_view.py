"""Scale and picture of the map in a figure."""

from __future__ import annotations

import base64

import numpy as np

from stack.types import FloatArray, OccupancyGrid

WIDTH = 720
"""Of the figure, in its own units; it is scaled to the page."""

MARGIN = 0.4
"""Metres around the shown places, at least."""


class MapView:
    """Scale of a map figure: metres to its units, north up.

    Args:
        grid: the map; None: there is none.
        x, y: places that the figure shows, map frame, metres; NaN: unknown.
    """

    def __init__(self, grid: OccupancyGrid | None, x: FloatArray, y: FloatArray) -> None:
        low = np.array([np.nanmin(x), np.nanmin(y)]) - MARGIN
        high = np.array([np.nanmax(x), np.nanmax(y)]) + MARGIN
        if grid is not None:
            rows, columns = np.nonzero(grid.cells >= 0)
            if len(rows):
                origin = np.array(grid.origin)
                known = np.array([columns.min(), rows.min()]), np.array([columns.max(), rows.max()])
                low = np.minimum(low, origin + known[0] * grid.resolution)
                high = np.maximum(high, origin + (known[1] + 1) * grid.resolution)
        self.low, self.high = low, high
        size = high - low
        self.scale = min(WIDTH / size[0], 0.9 * WIDTH / size[1])
        self.left = 0.5 * (WIDTH - size[0] * self.scale)
        self.height = float(size[1] * self.scale)

    def pixel(self, x: float, y: float) -> tuple[float, float]:
        """Place in the figure of a place on the map."""
        return self.left + (x - self.low[0]) * self.scale, (self.high[1] - y) * self.scale

    def pixels(self, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Places in the figure of places on the map."""
        return self.left + (x - self.low[0]) * self.scale, (self.high[1] - y) * self.scale

    def picture(self, grid: OccupancyGrid) -> str:
        """The map as a picture that suits light and dark pages."""
        import cv2

        cells = grid.cells
        pixels = np.zeros((*cells.shape, 4), np.uint8)
        pixels[grid.free] = (128, 128, 128, 28)
        pixels[grid.occupied] = (130, 120, 110, 255)
        done, encoded = cv2.imencode(".png", np.flipud(pixels))
        if not done:
            return ""
        height, width = cells.shape
        top = grid.origin[1] + height * grid.resolution
        x, y = self.pixel(grid.origin[0], top)
        code = base64.b64encode(encoded.tobytes()).decode()
        return (
            f'<image x="{x:.1f}" y="{y:.1f}" width="{width * grid.resolution * self.scale:.1f}" '
            f'height="{height * grid.resolution * self.scale:.1f}" '
            f'preserveAspectRatio="none" href="data:image/png;base64,{code}"/>'
        )
