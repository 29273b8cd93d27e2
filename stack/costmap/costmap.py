"""A layered costmap: the static map, what the lidar sees, and inflation around both.

Layers and cost values follow Nav2's costmap_2d (Lu, Hershberger and Smart, "Layered costmaps for
context-sensitive navigation", IROS 2014).
"""

from __future__ import annotations

from math import exp, floor
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stack.costmap.parameters import CostmapParameters
from stack.errors import ParameterError
from stack.types import (
    FREE_COST,
    INSCRIBED_COST,
    LETHAL_COST,
    OCCUPIED,
    UNKNOWN,
    UNKNOWN_COST,
    CostGrid,
    Footprint,
    OccupancyGrid,
    Pose2D,
    Scan,
)

Costs = NDArray[np.uint8]
Box = tuple[int, int, int, int]
"""First row, last row + 1, first column, last column + 1."""
_EXPIRY_PERIOD = 0.5  # s; looking for faded marks reads every cell, which large maps would feel


def inflation_costs(
    parameters: CostmapParameters, footprint: Footprint, resolution: float
) -> Costs:
    """Nav2's cost by squared distance in cells to the nearest lethal cell.

    cost(d) = 254 at d = 0, 253 for d <= r, else floor(252 · exp(-k (d - r))) with d in metres, r
    the inscribed radius and k the cost scaling. With a turning cost T the cost falls in a straight
    line from 252 at r to T at the circumscribed radius R, and as T · exp(-k (d - R)) beyond: an
    oblong robot then goes round a gap that it could pass but not turn in, unless that is far.

    Returns:
        (n² + 1,) uint8 where n is the inflation radius in whole cells.
    """
    inscribed, turning = footprint.inscribed_radius, footprint.circumscribed_radius
    top = float(INSCRIBED_COST - 1)
    if parameters.turning_cost == 0.0 or turning - inscribed < 1e-9:
        turning, base = inscribed, top
    else:
        base = parameters.turning_cost
    reach = floor(max(parameters.inflation_radius, turning) / resolution + 1e-6)
    costs = np.zeros(reach * reach + 1, dtype=np.uint8)
    for squared in range(costs.size):
        distance = float(squared) ** 0.5 * resolution
        if distance <= inscribed + 1e-9:
            costs[squared] = INSCRIBED_COST
        elif distance < turning:
            share = (distance - inscribed) / (turning - inscribed)
            costs[squared] = int(top + share * (base - top))
        else:
            costs[squared] = int(base * exp(-parameters.cost_scaling * (distance - turning)))
    costs[0] = LETHAL_COST
    return costs


class Costmap:
    """What each place costs to drive through, kept up to date from scans.

    Returns mark cells within `obstacle_range`, beams clear the cells they pass within
    `clearing_range` (no return, +inf, clears all the way; NaN does nothing), the robot's own
    footprint is always clear of marks, and marks unseen for `decay` seconds fade. Static obstacles
    are never cleared.

    Args:
        parameters: ranges and inflation.
        footprint: gives the inscribed radius and the cells under the robot.
        static: the map, or None.
        window: None to cover the map (global costmap); the side in metres of a square that rolls
            with the robot, aligned to the map's cells (local costmap).

    Raises:
        ParameterError: neither a map nor a window, or a window below three cells.
    """

    def __init__(
        self,
        parameters: CostmapParameters,
        footprint: Footprint,
        static: OccupancyGrid | None,
        *,
        window: float | None = None,
    ) -> None:
        from stack.costmap import kernels

        self._kernels: Any = kernels
        self._footprint, self._map, self._window = footprint, static, window
        self._version, self._next_expiry = 0, 0.0
        self._grid: CostGrid | None = None
        self._lay_out(parameters)
        self._recompute()

    @property
    def parameters(self) -> CostmapParameters:
        """The settings in force."""
        return self._parameters

    @property
    def version(self) -> int:
        """Grows with each change of cells or place."""
        return self._version

    @property
    def grid(self) -> CostGrid:
        """The costs now, a copy that later updates leave alone; UNKNOWN_COST where unknown."""
        if self._grid is None:
            self._grid = CostGrid(self._cells.copy(), self._resolution, self._origin)
        return self._grid

    @property
    def sensed(self) -> NDArray[np.bool_]:
        """(rows, columns): where the lidar has marked an obstacle that has not faded."""
        marked: NDArray[np.bool_] = self._marked_at > -np.inf
        return marked

    def update(self, pose: Pose2D, scan: Scan | None, time: float) -> None:
        """Take in a scan, or only let time pass and the window follow.

        Args:
            pose: of the base when the scan was taken, map frame.
            scan: a new scan, or None.
            time: seconds on the robot's clock.
        """
        moved = self._follow(pose)
        touched = self._forget_old(time)
        if scan is not None:
            touched = _around(touched, self._sense(pose, scan, time))
        touched = _around(touched, self._clear_footprint(pose))
        if moved:
            self._recompute()
        else:
            self._refresh(touched)

    def clear(self) -> None:
        """Forget what was sensed. The static map stays."""
        self._marked_at[:] = -np.inf
        self._seen[:] = 0
        self._refresh(self._everywhere)

    def set_static(self, static: OccupancyGrid) -> None:
        """Take another map, as SLAM makes them; sensed obstacles keep their places.

        Raises:
            ParameterError: the resolution of the map changed.
        """
        if self._window is None and static.resolution != self._resolution:
            raise ParameterError(
                "static",
                f"resolution {static.resolution:g} m, expected {self._resolution:g} m as before",
            )
        marked_at, seen, origin = self._marked_at, self._seen, self._origin
        self._map = static
        self._lay_out(self._parameters, origin)
        column, row = (
            round((new - old) / self._resolution)
            for new, old in zip(self._origin, origin, strict=True)
        )
        _overlay(self._marked_at, marked_at, row, column)
        _overlay(self._seen, seen, row, column)
        self._recompute()

    def configure(self, parameters: CostmapParameters) -> None:
        """Use other settings from now on, on the same cells; sensed obstacles stay."""
        self._parameters = parameters
        self._costs = inflation_costs(parameters, self._footprint, self._resolution)
        self._reach = round((self._costs.size - 1) ** 0.5)
        self._recompute()

    def _lay_out(
        self, parameters: CostmapParameters, near: tuple[float, float] | None = None
    ) -> None:
        """Fresh layers that cover the map, or a window (with its corner near a place)."""
        static, window = self._map, self._window
        if window is not None:
            self._resolution = parameters.resolution
            side = round(window / self._resolution)
            if side < 3:
                raise ParameterError(
                    "window", f"{window:g} m is less than three cells of {self._resolution:g} m"
                )
            shape = (side, side)
            self._lattice = (0.0, 0.0) if static is None else static.origin
            x, y = near or (-window / 2, -window / 2)
            self._corner = self._corner_near(x, y)
        elif static is not None:
            self._resolution, shape = static.resolution, static.cells.shape
            self._lattice, self._corner = static.origin, (0, 0)
        else:
            raise ParameterError("window", "a costmap without a map needs a window, e.g. 5 m")
        self._marked_at = np.full(shape, -np.inf, dtype=np.float32)
        self._seen = np.zeros(shape, dtype=np.uint8)
        self._base, self._cells = np.empty(shape, np.uint8), np.empty(shape, np.uint8)
        self._everywhere: Box = (0, shape[0], 0, shape[1])
        self._static = self._static_cells()
        self._parameters = parameters
        self._costs = inflation_costs(parameters, self._footprint, self._resolution)
        self._reach = round((self._costs.size - 1) ** 0.5)

    @property
    def _origin(self) -> tuple[float, float]:
        row, column = self._corner
        x, y = self._lattice
        return x + column * self._resolution, y + row * self._resolution

    def _corner_near(self, x: float, y: float) -> tuple[int, int]:
        """Row and column on the lattice of the cell corner nearest to a point."""
        left, low = self._lattice
        return round((y - low) / self._resolution), round((x - left) / self._resolution)

    def _static_cells(self) -> Costs:
        """The map's cells at the middles of ours, as costs; unknown where there is no map."""
        rows, columns = self._marked_at.shape
        if self._map is None:
            return np.full((rows, columns), UNKNOWN_COST, dtype=np.uint8)
        x, y = self._origin
        left, low = self._map.origin
        scale = self._resolution / self._map.resolution
        row = np.floor((y - low) / self._map.resolution + (np.arange(rows) + 0.5) * scale)
        column = np.floor((x - left) / self._map.resolution + (np.arange(columns) + 0.5) * scale)
        on_rows = (row >= 0) & (row < self._map.cells.shape[0])
        on_columns = (column >= 0) & (column < self._map.cells.shape[1])
        values = np.full((rows, columns), UNKNOWN, dtype=np.int8)
        values[np.ix_(on_rows, on_columns)] = self._map.cells[
            np.ix_(row[on_rows].astype(int), column[on_columns].astype(int))
        ]
        costs = np.full((rows, columns), FREE_COST, dtype=np.uint8)
        costs[values == OCCUPIED] = LETHAL_COST
        costs[values == UNKNOWN] = UNKNOWN_COST
        return costs

    def _follow(self, pose: Pose2D) -> bool:
        """Roll the window so that the robot is in its middle; whether it moved."""
        if self._window is None:
            return False
        half = self._marked_at.shape[0] * self._resolution / 2
        corner = self._corner_near(pose.x - half, pose.y - half)
        row, column = corner[0] - self._corner[0], corner[1] - self._corner[1]
        if row == 0 and column == 0:
            return False
        self._corner = corner
        marked_at, seen = self._marked_at, self._seen
        self._marked_at, self._seen = np.full_like(marked_at, -np.inf), np.zeros_like(seen)
        _overlay(self._marked_at, marked_at, row, column)
        _overlay(self._seen, seen, row, column)
        self._static = self._static_cells()
        return True

    def _forget_old(self, time: float) -> Box:
        if self._parameters.decay == 0.0 or time < self._next_expiry:
            return 0, 0, 0, 0
        self._next_expiry = time + _EXPIRY_PERIOD
        oldest = time - self._parameters.decay
        box: Box = self._kernels.expire(self._marked_at, oldest, *self._everywhere)
        return box

    def _sense(self, pose: Pose2D, scan: Scan, time: float) -> Box:
        sensor = pose.compose(scan.mount)
        box: Box = self._kernels.sense(
            self._marked_at, self._seen, *self._origin, self._resolution,
            sensor.x, sensor.y, sensor.heading,
            scan.ranges, scan.angle_min, scan.angle_increment, scan.range_max,
            self._parameters.obstacle_range, self._parameters.clearing_range, time,
        )  # fmt: skip
        return box

    def _clear_footprint(self, pose: Pose2D) -> Box:
        corners = pose.transform(self._footprint.points)
        box: Box = self._kernels.clear_polygon(
            self._marked_at, self._seen, *self._origin, self._resolution, corners
        )
        return box

    def _recompute(self) -> None:
        """All cells anew, after the layers moved or the settings changed."""
        self._compose(self._everywhere)
        self._inflate(self._everywhere)

    def _refresh(self, touched: Box) -> None:
        """Compose what was touched and inflate around what changed."""
        if self._parameters.denoise:
            touched = self._grown(touched, 1)
        changed = self._compose(touched)
        if changed[0] < changed[1]:
            self._inflate(self._grown(changed, self._reach))

    def _compose(self, box: Box) -> Box:
        changed: Box = self._kernels.compose(
            self._base, self._static, self._marked_at, self._seen, self._parameters.denoise, *box
        )
        return changed

    def _inflate(self, box: Box) -> None:
        self._kernels.inflate(self._cells, self._base, self._costs, self._reach, *box)
        self._grid = None
        self._version += 1

    def _grown(self, box: Box, by: int) -> Box:
        rows, columns = self._cells.shape
        top, bottom, left, right = box
        return max(top - by, 0), min(bottom + by, rows), max(left - by, 0), min(right + by, columns)


def _around(one: Box, other: Box) -> Box:
    """The smallest box around both."""
    if one[0] >= one[1]:
        return other
    if other[0] >= other[1]:
        return one
    return (
        min(one[0], other[0]), max(one[1], other[1]), min(one[2], other[2]), max(one[3], other[3])
    )  # fmt: skip


def _overlay(target: NDArray[Any], source: NDArray[Any], row: int, column: int) -> None:
    """Copy the overlap, where target's cell (0, 0) lies over source's (row, column)."""
    rows = min(target.shape[0], source.shape[0] - row) - max(0, -row)
    columns = min(target.shape[1], source.shape[1] - column) - max(0, -column)
    if rows <= 0 or columns <= 0:
        return
    to_row, to_column = max(0, -row), max(0, -column)
    from_row, from_column = max(0, row), max(0, column)
    target[to_row : to_row + rows, to_column : to_column + columns] = source[
        from_row : from_row + rows, from_column : from_column + columns
    ]
