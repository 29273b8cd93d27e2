"""Tracker of moving objects in scans.

Circles are fitted to clusters of returns that are not on the map. Each is associated with the
nearest track inside a gate and updates it by a Kalman filter with a constant-velocity model
(Bar-Shalom, Li and Kirubarajan, "Estimation with Applications to Tracking and Navigation", 2001,
sections 5.2 and 6.2).
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace
from math import ceil, floor, hypot, pi

import numpy as np
from numpy.typing import NDArray

from stack.perception.clusters import Disc, bridged, clusters, disc_of, spread_of
from stack.perception.tracker_parameters import TrackerParameters
from stack.types import FloatArray, OccupancyGrid, Pose2D, Scan, TrackedObject

_HIDDEN_NOISE = 4.0
"""Factor on the position deviation of a partly hidden disc."""
VIEWS = 10
"""Number of newest scans that tell which ground was free."""
PART = 1.25
"""Radii from the centre of a moving object within which a disc is a part of it."""
BESIDE = 0.05
"""Metres to each side of a point in which no beam may end if the point is free."""
BEHIND = 0.15
"""Metres behind a point at which beams must not have ended if it is free."""
SHARE = 0.5
"""Share of an object's returns on ground seen free that shows that it has moved."""
_RADIUS_SHARE = 0.2
"""Gain of the radius's exponential mean."""


@dataclass(frozen=True, slots=True)
class _View:
    """A scan and the pose of its sensor, map frame."""

    sensor: Pose2D
    scan: Scan

    def points(self, run: tuple[int, int]) -> FloatArray:
        """Return (n, 2) the returns of a run of beams, map frame."""
        scan = self.scan
        beams = np.arange(*run) % scan.ranges.size
        ranges = scan.ranges[beams].astype(np.float64)
        angles = self.sensor.heading + scan.angle_min + scan.angle_increment * beams
        found: FloatArray = np.column_stack((np.cos(angles), np.sin(angles))) * ranges[:, None]
        found += self.sensor.x, self.sensor.y
        return found[np.isfinite(ranges)]

    def share_passed(self, points: FloatArray) -> float:
        """Return the share of points (n, 2), map frame, past which all beams around them end.

        A beam that ends close behind a point may have met the same surface, and so may one beside
        it.
        """
        scan = self.scan
        if not len(points):
            return 0.0
        away = points - (self.sensor.x, self.sensor.y)
        distances = np.hypot(away[:, 0], away[:, 1])
        angles = np.arctan2(away[:, 1], away[:, 0]) - self.sensor.heading - scan.angle_min
        increment, count = abs(scan.angle_increment), scan.ranges.size
        middle = np.rint(angles / scan.angle_increment).astype(np.intp)
        beside = ceil(BESIDE / max(float(distances.min()), BESIDE) / increment)
        beams = (middle[:, None] + np.arange(-beside, beside + 1)) % round(2.0 * pi / increment)
        ranges = np.append(scan.ranges, -np.inf)[np.minimum(beams, count)]  # -inf: not seen
        passed = ranges.min(axis=1) > distances + BEHIND
        return float(np.mean(passed & (distances + BEHIND < scan.range_max)))


@dataclass
class _ObjectFilter:
    """Kalman filter of one object: state (4,) x, y, velocity x, y; covariance (4, 4)."""

    id: int
    state: FloatArray
    covariance: FloatArray
    radius: float
    began: tuple[float, float]
    seen_at: float
    seen: deque[tuple[_View, tuple[int, int]]]
    hits: int = 1
    has_moved: bool = False


class Tracker:
    """Multi-object tracker of moving objects around the robot.

    An object that has moved remains a track while it is at rest. Without a map, static objects are
    tracked as well but not reported. When the view of a static thing changes, its disc wanders
    along its surface, or jumps to another thing; so an object has moved only if most of its returns
    lie on ground that was seen free a moment ago, or its returns of then on ground seen free now.
    """

    def __init__(self, parameters: TrackerParameters, static: OccupancyGrid | None = None) -> None:
        """Create a tracker without tracks.

        Args:
            parameters: of detection and tracking.
            static: the map, whose obstacles do not move; None without a map.
        """
        self.parameters = parameters
        self._filters: list[_ObjectFilter] = []
        self._next_id, self._time = 1, 0.0
        self._views: deque[_View] = deque(maxlen=VIEWS)
        self._static: OccupancyGrid | None = None
        self._near_map: NDArray[np.bool_] = np.zeros((0, 0), dtype=np.bool_)
        if static is not None:
            self.set_static(static)

    def set_static(self, static: OccupancyGrid) -> None:
        """Replace the map; takes effect with the next scan."""
        self._static = static
        reach = floor(self.parameters.map_margin / static.resolution + 1e-9)
        self._near_map = _widened(static.occupied, reach)

    def clear(self) -> None:
        """Remove all tracks, for example after a jump of the robot's pose."""
        self._filters = []
        self._views.clear()

    def update(self, pose: Pose2D, scan: Scan, time: float) -> tuple[TrackedObject, ...]:
        """Update the tracks with a scan.

        Args:
            pose: of the base when the scan was taken, map frame.
            scan: a new scan.
            time: seconds on the robot's clock.

        Returns:
            The moving objects, in order of their ids.
        """
        self._predict(max(0.0, time - self._time))
        self._time = time
        self._views.append(_View(pose.compose(scan.mount), scan))
        discs = self.discs(pose, scan)
        taken = self._correct(discs)
        for index, disc in enumerate(discs):
            if index not in taken and disc.is_whole and not self._is_known(disc):
                self._begin(disc)
        oldest = time - self.parameters.forget
        self._filters = [item for item in self._filters if item.seen_at > oldest - 1e-9]
        return tuple(self._track(item) for item in self._filters if item.has_moved)

    def discs(self, pose: Pose2D, scan: Scan) -> list[Disc]:
        """Return the discs in a scan that are not on the map, map frame."""
        settings = self.parameters
        scan = replace(scan, ranges=bridged(scan.ranges, settings.jump))
        ranges = scan.ranges.astype(np.float64)
        valid = np.isfinite(ranges) & (ranges <= settings.range)
        ignored: NDArray[np.bool_] | None = None
        if self._static is not None:
            ignored = valid & self._on_map(pose, scan, valid)
            valid &= ~ignored
        found = []
        for run in clusters(ranges, scan.angle_increment, settings.jump, valid):
            small = spread_of(scan, run) <= 2.0 * settings.largest_radius
            if run[1] - run[0] < settings.least_beams or not small:
                continue
            disc = disc_of(scan, pose, run, settings.jump, ignored)
            if disc is not None and disc.radius <= settings.largest_radius:
                found.append(disc)
        return found

    def _on_map(self, pose: Pose2D, scan: Scan, valid: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return (n,) whether a beam ends on or near an obstacle of the map."""
        assert self._static is not None
        ranges = np.where(valid, scan.ranges, 0.0)
        sensor, resolution = pose.compose(scan.mount), self._static.resolution
        angles = scan.angles + sensor.heading
        rows, columns = self._near_map.shape
        x, y = self._static.origin
        column = ((ranges * np.cos(angles) + (sensor.x - x)) / resolution).astype(np.intp)
        row = ((ranges * np.sin(angles) + (sensor.y - y)) / resolution).astype(np.intp)
        # rounding towards zero puts what is up to a cell outside into the border, which is harmless
        on_grid = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
        near: NDArray[np.bool_] = self._near_map[row * on_grid, column * on_grid] & on_grid
        return near

    def _predict(self, seconds: float) -> None:
        """x' = F x, P' = F P F^T + Q; Q of a random acceleration that is constant over the step."""
        if not self._filters:
            return
        forward = np.eye(4)
        forward[0, 2] = forward[1, 3] = seconds
        push = np.array([[0.5 * seconds**2, 0.0], [0.0, 0.5 * seconds**2],
                         [seconds, 0.0], [0.0, seconds]])  # fmt: skip
        noise = self.parameters.acceleration**2 * push @ push.T
        for item in self._filters:
            item.state = forward @ item.state
            item.covariance = forward @ item.covariance @ forward.T + noise

    def _correct(self, discs: list[Disc]) -> set[int]:
        """Associate discs with filters; return the indices of used discs.

        Confirmed tracks come before new ones, and then nearest pairs first: a new track is
        uncertain, so that every disc is near to it.
        """
        distances = self._mahalanobis(discs)
        confirm = self.parameters.confirm
        pairs = sorted(
            (self._filters[order].hits < confirm, float(distances[order, index]), index, order)
            for order, index in np.argwhere(distances <= self.parameters.gate).tolist()
        )
        taken: set[int] = set()
        updated: set[int] = set()
        for _, _, index, order in pairs:
            if index not in taken and order not in updated:
                taken.add(index)
                updated.add(order)
                self._correct_filter(self._filters[order], discs[index])
        return taken

    def _variance(self, disc: Disc) -> float:
        """Return the variance of a disc's centre along each axis, m²."""
        factor = 1.0 if disc.is_whole else _HIDDEN_NOISE
        return (factor * self.parameters.position_noise) ** 2

    def _mahalanobis(self, discs: list[Disc]) -> FloatArray:
        """Return (filters, discs) squared Mahalanobis distances d^T S^-1 d, S = H P H^T + R."""
        if not self._filters or not discs:
            return np.zeros((0, 0))
        noise = np.array([self._variance(disc) for disc in discs])
        state = np.array([item.state[:2] for item in self._filters])
        spread = np.array([item.covariance[:2, :2] for item in self._filters])
        x = np.array([disc.x for disc in discs]) - state[:, :1]
        y = np.array([disc.y for disc in discs]) - state[:, 1:]
        xx, xy, yy = spread[:, :1, 0] + noise, spread[:, :1, 1], spread[:, 1:, 1] + noise
        distances: FloatArray = (yy * x * x - 2.0 * xy * x * y + xx * y * y) / (xx * yy - xy * xy)
        return distances

    def _correct_filter(self, item: _ObjectFilter, disc: Disc) -> None:
        """K = P H^T S^-1; x' = x + K (z - H x); P' = (I - K H) P."""
        covariance, noise = item.covariance, self._variance(disc)
        xx, xy = covariance[0, 0] + noise, covariance[0, 1]
        yy = covariance[1, 1] + noise
        inverse = np.array([[yy, -xy], [-xy, xx]]) / (xx * yy - xy * xy)
        gain = covariance[:, :2] @ inverse
        item.state = item.state + gain @ (disc.x - item.state[0], disc.y - item.state[1])
        corrected = covariance - gain @ covariance[:2, :]
        item.covariance = 0.5 * (corrected + corrected.T)
        if disc.is_whole:
            item.radius += _RADIUS_SHARE * (disc.radius - item.radius)
        item.hits, item.seen_at = item.hits + 1, self._time
        item.seen.append((self._views[-1], disc.run))
        item.has_moved |= self._moves(item)

    def _moves(self, item: _ObjectFilter) -> bool:
        x, y, speed_x, speed_y = item.state
        gone = hypot(x - item.began[0], y - item.began[1])
        speed = hypot(speed_x, speed_y)
        return bool(
            item.hits >= self.parameters.confirm
            and speed >= self.parameters.moving_speed
            and gone >= self.parameters.moving_distance
            and self._left_its_ground(item)
        )

    def _left_its_ground(self, item: _ObjectFilter) -> bool:
        """Whether it is where ground was seen free, or its old place is seen free now."""
        views = list(self._views)
        (now, run), (then, old) = item.seen[-1], item.seen[0]
        if now.share_passed(then.points(old)) >= SHARE:
            return True
        points = now.points(run)
        return any(view.share_passed(points) >= SHARE for view in views[: len(views) // 2])

    def _is_known(self, disc: Disc) -> bool:
        """Whether a disc lies inside a moving object: it is a part of it."""
        moving = (item for item in self._filters if item.has_moved)
        return any(
            hypot(disc.x - item.state[0], disc.y - item.state[1])
            < PART * max(item.radius, disc.radius)
            for item in moving
        )

    def _begin(self, disc: Disc) -> None:
        settings = self.parameters
        variances = [settings.position_noise**2] * 2 + [settings.first_speed**2] * 2
        self._filters.append(
            _ObjectFilter(
                self._next_id, np.array([disc.x, disc.y, 0.0, 0.0]), np.diag(variances),
                disc.radius, (disc.x, disc.y), self._time,
                deque([(self._views[-1], disc.run)], maxlen=VIEWS),
            )
        )  # fmt: skip
        self._next_id += 1

    def _track(self, item: _ObjectFilter) -> TrackedObject:
        x, y, speed_x, speed_y = map(float, item.state)
        return TrackedObject(
            item.id, self._time, (x, y), (speed_x, speed_y), item.radius, item.covariance.copy()
        )


def _widened(cells: NDArray[np.bool_], by: int) -> NDArray[np.bool_]:
    """Return the cells within a distance (in cells) of a true one."""
    rows, columns = cells.shape
    wide = np.zeros_like(cells)
    around = np.pad(cells, by)
    for row in range(2 * by + 1):
        for column in range(2 * by + 1):
            if hypot(row - by, column - by) <= by + 1e-9:
                wide |= around[row : row + rows, column : column + columns]
    return wide
