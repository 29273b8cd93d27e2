"""Follows moving things from scan to scan.

Runs of returns that are not the map's become discs; each is matched with the nearest track inside
a gate and corrects it by a Kalman filter with constant velocity (Bar-Shalom, Li and Kirubarajan,
"Estimation with Applications to Tracking and Navigation", 2001, sections 5.2 and 6.2).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import floor, hypot

import numpy as np
from numpy.typing import NDArray

from stack.perception.clusters import Disc, clusters, disc_of, spread_of
from stack.perception.tracker_parameters import TrackerParameters
from stack.types import OCCUPIED, FloatArray, OccupancyGrid, Pose2D, Scan, TrackedObject

_HIDDEN_NOISE = 4.0
"""Factor of the deviation of a disc that something hides a part of."""
_RADIUS_SHARE = 0.2
"""How much of a new radius is taken over."""


@dataclass
class _Follower:
    """The filter of one thing: state (4,) x, y and velocity x, y; covariance (4, 4)."""

    id: int
    state: FloatArray
    covariance: FloatArray
    radius: float
    began: tuple[float, float]
    seen_at: float
    hits: int = 1
    has_moved: bool = False


class Tracker:
    """Tracks of everything round the robot that moves.

    What once moved stays a track while it stands for a moment. Without a map everything that does
    not move is followed, too, and kept back.
    """

    def __init__(self, parameters: TrackerParameters, static: OccupancyGrid | None = None) -> None:
        """Nothing is followed yet.

        Args:
            parameters: see there.
            static: the map, whose obstacles do not move; None without one.
        """
        self.parameters = parameters
        self._followers: list[_Follower] = []
        self._next_id, self._time = 1, 0.0
        self._static: OccupancyGrid | None = None
        self._near_map: NDArray[np.bool_] = np.zeros((0, 0), dtype=np.bool_)
        if static is not None:
            self.set_static(static)

    def set_static(self, static: OccupancyGrid) -> None:
        """Use another map from the next scan on."""
        self._static = static
        reach = floor(self.parameters.map_margin / static.resolution + 1e-9)
        self._near_map = _widened(static.cells == OCCUPIED, reach)

    def clear(self) -> None:
        """Follow nothing any more, as after a jump of the robot's pose."""
        self._followers = []

    def update(self, pose: Pose2D, scan: Scan, time: float) -> tuple[TrackedObject, ...]:
        """Take in a scan.

        Args:
            pose: of the base when the scan was taken, map frame.
            scan: a new one.
            time: seconds on the robot's clock.

        Returns:
            What moves, by id.
        """
        self._predict(max(0.0, time - self._time))
        self._time = time
        discs = self.discs(pose, scan)
        taken = self._correct(discs)
        for index, disc in enumerate(discs):
            if index not in taken and disc.is_whole:
                self._begin(disc)
        oldest = time - self.parameters.forget
        self._followers = [item for item in self._followers if item.seen_at > oldest - 1e-9]
        return tuple(self._track(item) for item in self._followers if item.has_moved)

    def discs(self, pose: Pose2D, scan: Scan) -> list[Disc]:
        """Round things in a scan that are not the map's, map frame."""
        settings = self.parameters
        ranges = scan.ranges.astype(np.float64)
        valid = np.isfinite(ranges) & (ranges <= settings.range)
        if self._static is not None:
            valid &= ~self._on_map(pose, scan, valid)
        found = []
        for run in clusters(ranges, scan.angle_increment, settings.jump, valid):
            small = spread_of(scan, run) <= 2.0 * settings.largest_radius
            if run[1] - run[0] < settings.least_beams or not small:
                continue
            disc = disc_of(scan, pose, run, settings.jump)
            if disc is not None and disc.radius <= settings.largest_radius:
                found.append(disc)
        return found

    def _on_map(self, pose: Pose2D, scan: Scan, valid: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """(n,): which beams end on or near an obstacle of the map."""
        assert self._static is not None
        ranges = np.where(valid, scan.ranges.astype(np.float64), 0.0)
        ends = np.column_stack([ranges * np.cos(scan.angles), ranges * np.sin(scan.angles)])
        points = pose.compose(scan.mount).transform(ends)
        cells = np.floor((points - self._static.origin) / self._static.resolution).astype(int)
        rows, columns = self._near_map.shape
        column, row = cells[:, 0], cells[:, 1]
        on_grid = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
        near = np.zeros(ranges.size, dtype=np.bool_)
        near[on_grid] = self._near_map[row[on_grid], column[on_grid]]
        return near

    def _predict(self, seconds: float) -> None:
        """x' = F x, P' = F P F^T + Q; Q of a random acceleration constant over the step."""
        forward = np.eye(4)
        forward[0, 2] = forward[1, 3] = seconds
        push = np.array([[0.5 * seconds**2, 0.0], [0.0, 0.5 * seconds**2],
                         [seconds, 0.0], [0.0, seconds]])  # fmt: skip
        noise = self.parameters.acceleration**2 * push @ push.T
        for item in self._followers:
            item.state = forward @ item.state
            item.covariance = forward @ item.covariance @ forward.T + noise

    def _correct(self, discs: list[Disc]) -> set[int]:
        """Match discs with followers, the nearest pairs first; indices of the matched discs."""
        distances = self._mahalanobis(discs)
        pairs = sorted(
            (float(distances[order, index]), index, order)
            for order, index in np.argwhere(distances <= self.parameters.gate).tolist()
        )
        taken: set[int] = set()
        followed: set[int] = set()
        for _, index, order in pairs:
            if index not in taken and order not in followed:
                taken.add(index)
                followed.add(order)
                self._take(self._followers[order], discs[index])
        return taken

    def _variance(self, disc: Disc) -> float:
        """Of a disc's middle along each axis, m²."""
        factor = 1.0 if disc.is_whole else _HIDDEN_NOISE
        return (factor * self.parameters.position_noise) ** 2

    def _mahalanobis(self, discs: list[Disc]) -> FloatArray:
        """(followers, discs): squared distances d^T S^-1 d, S = H P H^T + R."""
        if not self._followers or not discs:
            return np.zeros((0, 0))
        noise = np.array([self._variance(disc) for disc in discs])
        state = np.array([item.state[:2] for item in self._followers])
        spread = np.array([item.covariance[:2, :2] for item in self._followers])
        x = np.array([disc.x for disc in discs]) - state[:, :1]
        y = np.array([disc.y for disc in discs]) - state[:, 1:]
        xx, xy, yy = spread[:, :1, 0] + noise, spread[:, :1, 1], spread[:, 1:, 1] + noise
        distances: FloatArray = (yy * x * x - 2.0 * xy * x * y + xx * y * y) / (xx * yy - xy * xy)
        return distances

    def _take(self, follower: _Follower, disc: Disc) -> None:
        """K = P H^T S^-1; x' = x + K (z - H x); P' = (I - K H) P."""
        covariance = follower.covariance
        spread = covariance[:2, :2] + self._variance(disc) * np.eye(2)
        gain = np.linalg.solve(spread, covariance[:2, :]).T
        follower.state = follower.state + gain @ (np.array([disc.x, disc.y]) - follower.state[:2])
        corrected = covariance - gain @ covariance[:2, :]
        follower.covariance = 0.5 * (corrected + corrected.T)
        if disc.is_whole:
            follower.radius += _RADIUS_SHARE * (disc.radius - follower.radius)
        follower.hits, follower.seen_at = follower.hits + 1, self._time
        follower.has_moved |= self._moves(follower)

    def _moves(self, follower: _Follower) -> bool:
        x, y, speed_x, speed_y = follower.state
        gone = hypot(x - follower.began[0], y - follower.began[1])
        return bool(
            follower.hits >= self.parameters.confirm
            and hypot(speed_x, speed_y) >= self.parameters.moving_speed
            and gone >= self.parameters.moving_distance
        )

    def _begin(self, disc: Disc) -> None:
        settings = self.parameters
        variances = [settings.position_noise**2] * 2 + [settings.first_speed**2] * 2
        self._followers.append(
            _Follower(
                self._next_id, np.array([disc.x, disc.y, 0.0, 0.0]), np.diag(variances),
                disc.radius, (disc.x, disc.y), self._time,
            )
        )  # fmt: skip
        self._next_id += 1

    def _track(self, item: _Follower) -> TrackedObject:
        x, y, speed_x, speed_y = map(float, item.state)
        return TrackedObject(
            item.id, self._time, (x, y), (speed_x, speed_y), item.radius, item.covariance.copy()
        )


def _widened(cells: NDArray[np.bool_], by: int) -> NDArray[np.bool_]:
    """Cells within a distance (in cells) of a true one."""
    rows, columns = cells.shape
    wide = np.zeros_like(cells)
    around = np.pad(cells, by)
    for row in range(2 * by + 1):
        for column in range(2 * by + 1):
            if hypot(row - by, column - by) <= by + 1e-9:
                wide |= around[row : row + rows, column : column + columns]
    return wide
