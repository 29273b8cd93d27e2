"""Tracker of moving objects in scans.

Circles are fitted to clusters of returns that are not on the map. Each is associated with the
nearest track inside a gate and updates it by a Kalman filter with a constant-velocity model
(Bar-Shalom, Li and Kirubarajan, "Estimation with Applications to Tracking and Navigation", 2001,
sections 5.2 and 6.2). A cluster of two bodies that touch is divided, and the arc of one that is
partly hidden gives its circle, if it is long enough (arcs.py). The returns of a moving object that
shows less are fitted to the surface of a circle of the known radius. One whose place is
seen through is not there any more.
"""

from __future__ import annotations

from collections import deque
from itertools import compress
from math import floor, hypot, sqrt
from operator import attrgetter, not_

import numpy as np
from numpy.typing import NDArray

from stack.compilation import KernelTypes
from stack.perception.tracking.clusters import Disc, bridged, clusters, disc_of, parts_of, spread_of
from stack.perception.tracking.object_filter import ObjectFilter, Sighting
from stack.perception.tracking.out_of_sight import ABSENT, OutOfSight
from stack.perception.tracking.parameters import TrackerParameters
from stack.perception.tracking.standing import StandingPlaces
from stack.perception.tracking.surface_fit import has_edge, surface_fit
from stack.perception.tracking.view import View
from stack.types import FloatArray, OccupancyGrid, Pose2D, Scan, StandingObject, TrackedObject

JUMP = 0.3
"""Neighbouring returns farther apart belong to different objects, m."""
LEAST_BEAMS = 3
"""Smallest number of returns of an object."""
LARGEST_RADIUS = 0.7
"""Larger objects count as walls, m."""
MAP_MARGIN = 0.15
"""Returns this close to a mapped obstacle belong to the map, m."""
GATE = 9.21
"""Largest squared Mahalanobis distance of a match; 9.21 covers 99 %."""
ACCELERATION = 2.0
"""Standard deviation of an object's acceleration, m/s²."""
POSITION_NOISE = 0.05
"""Standard deviation of an object's centre in one scan, m."""
FIRST_SPEED = 1.0
"""Standard deviation of the velocity of a new track, m/s."""
MOVING_SPEED = 0.25
"""An object counts as moving if it has reached this speed, m/s."""
MOVING_DISTANCE = 0.15
"""Distance from its first position that a moving object has come, m: noise moves a standing one by
less."""

HIDDEN_NOISE = 4.0
"""Factor on the position deviation of a partly hidden disc."""

VIEWS = 10
"""Number of newest scans that tell which ground was free."""

PART = 1.25
"""Radii from the centre of a moving object within which a disc is a part of it."""

SHARE = 0.5
"""Share of an object's returns on ground seen free that shows that it has moved."""

PARTLY = 2.0
"""Seconds after a scan determined its circle for which a part of its surface shows an object."""

STOOD = 0.2
"""Metres from the centre of what stands within which a disc is that thing."""

MANOEUVRE = 0.6
"""Metres from its expected place within which a lost object is a disc that nothing has matched."""


class Tracker:
    """Multi-object tracker of moving objects around the robot.

    An object that has moved remains a track while it is at rest. Without a map, static objects are
    tracked as well but not reported. When the view of a static thing changes, its disc wanders
    along its surface, or jumps to another thing; so an object has moved only if most of its returns
    lie on ground that was seen free a moment ago, or its returns of then on ground seen free now.
    """

    @staticmethod
    def kernels() -> KernelTypes:
        """Return the kernels of the tracker."""
        from stack.perception.tracking.kernels import TRACKING  # imports numba

        return TRACKING

    def __init__(self, parameters: TrackerParameters, static: OccupancyGrid | None = None) -> None:
        """Create a tracker without tracks.

        Args:
            parameters: of detection and tracking.
            static: the map, whose obstacles do not move; None without a map.
        """
        self.parameters = parameters
        self._filters: list[ObjectFilter] = []
        self._next_id, self._time, self._before = 1, 0.0, 0.0
        self._views: deque[View] = deque(maxlen=VIEWS)
        self._places, self._out_of_sight = StandingPlaces(), OutOfSight()
        self._static: OccupancyGrid | None = None
        self._near_map: NDArray[np.bool_] = np.zeros((0, 0), dtype=np.bool_)
        if static is not None:
            self.set_static(static)

    def set_static(self, static: OccupancyGrid) -> None:
        """Replace the map; takes effect with the next scan."""
        self._static = static
        reach = floor(MAP_MARGIN / static.resolution + 1e-9)
        self._near_map = _widened(static.occupied, reach)

    def clear(self) -> None:
        """Remove all tracks and places, for example after a jump of the robot's pose."""
        self._filters = []
        self._views.clear()
        self._places.clear()
        self._out_of_sight.clear()

    def update(self, pose: Pose2D, scan: Scan, time: float) -> tuple[TrackedObject, ...]:
        """Update the tracks with a scan.

        Args:
            pose: of the base when the scan was taken, map frame.
            scan: a new scan.
            time: seconds on the robot's clock.

        Returns:
            The moving objects, in order of their ids.
        """
        for item in self._filters:
            item.predict(max(0.0, time - self._time), ACCELERATION)
        self._before, self._time = self._time, time
        self._views.append(View(pose.compose(scan.mount), scan))
        discs = self.discs(pose, scan)
        taken = self._correct(discs)
        taken |= self._correct_manoeuvring(discs, taken)
        self._correct_by_surface(pose)
        for index, disc in enumerate(discs):
            if index not in taken and disc.is_circle and not self._is_known(disc):
                self._begin(disc)
        self._note_absent()
        self._out_of_sight.look(self._views[-1], time)
        oldest = time - self.parameters.forget - 1e-9
        stay = [item.seen_at > oldest and item.absent < ABSENT for item in self._filters]
        self._out_of_sight.note(compress(self._filters, map(not_, stay)))
        self._filters = list(compress(self._filters, stay))
        self._places.look(self._views[-1])
        found = [(item.state[0], item.state[1], item.radius) for item in self._standing()]
        if found:
            self._places.note(np.array(found), time)
        return tuple(item.track(time) for item in self._filters if item.has_moved)

    @property
    def known_ids(self) -> frozenset[int]:
        """Ids of all objects that a scan may show again, also of those out of sight."""
        return self._out_of_sight.ids.union(item.id for item in self._filters)

    @property
    def standing(self) -> tuple[StandingObject, ...]:
        """Objects in the newest scan that are not on the map and have not moved, by id.

        They may be things, or people who stood already when they were seen first. Who begins to
        move becomes a moving object of the same id.
        """
        return tuple(
            item.standing(self._time, self._places.since(*item.state[:2]))
            for item in self._standing()
        )

    def _standing(self) -> list[ObjectFilter]:
        """Return what stands in the newest scan."""
        return [
            item for item in self._filters
            if not item.has_moved
            and item.hits >= self.parameters.confirm
            and item.seen_at == self._time
        ]  # fmt: skip

    def discs(self, pose: Pose2D, scan: Scan) -> list[Disc]:
        """Return the discs in a scan that are not on the map, map frame."""
        settings = self.parameters
        scan = scan.with_ranges(bridged(scan.ranges, JUMP))
        ranges = scan.ranges.astype(np.float64)
        valid = np.isfinite(ranges) & (ranges <= settings.range)
        ignored: NDArray[np.bool_] | None = None
        if self._static is not None:
            ignored = self._on_map(pose, scan, valid)
            valid &= ~ignored
        found = []
        for cluster in clusters(ranges, scan.angle_increment, JUMP, valid):
            if cluster[1] - cluster[0] < LEAST_BEAMS:
                continue
            runs = parts_of(scan, cluster)
            for run in runs:
                small = spread_of(scan, run) <= 2.0 * LARGEST_RADIUS
                if run[1] - run[0] < LEAST_BEAMS or not small:
                    continue
                disc = disc_of(scan, pose, run, JUMP, ignored, is_part=len(runs) > 1)
                if disc is not None and disc.radius <= LARGEST_RADIUS:
                    found.append(disc)
        return found

    def _on_map(self, pose: Pose2D, scan: Scan, valid: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return (n,) whether a valid beam ends on or near an obstacle of the map."""
        assert self._static is not None
        beams, (x, y) = np.flatnonzero(valid), self._static.origin
        cells = ((View(pose.compose(scan.mount), scan).ends(beams) - (x, y))
                 / self._static.resolution).astype(np.intp)  # fmt: skip
        near: NDArray[np.bool_] = np.zeros(valid.size, dtype=np.bool_)
        # rounding towards zero puts what is up to a cell outside into the border: harmless
        inside = ((cells >= 0) & (cells < self._near_map.shape[::-1])).all(axis=1)
        column, row = cells[inside].T
        near[beams[inside]] = self._near_map[row, column]
        return near

    def _correct(self, discs: list[Disc]) -> set[int]:
        """Associate discs with filters; return the indices of used discs.

        Confirmed tracks come before new ones, and then nearest pairs first: a new track is
        uncertain, so that every disc is near to it.
        """
        distances = self._mahalanobis(discs)
        confirm = self.parameters.confirm
        pairs = sorted(
            (self._filters[order].hits < confirm, distance, index, order)
            for order, row in enumerate(distances.tolist())
            for index, distance in enumerate(row)
            if distance <= GATE and self._may_be(self._filters[order], discs[index])
        )
        taken: set[int] = set()
        updated: set[int] = set()
        for _, _, index, order in pairs:
            if index not in taken and order not in updated:
                taken.add(index)
                updated.add(order)
                self._correct_filter(self._filters[order], discs[index])
        return taken

    def _may_be(self, item: ObjectFilter, disc: Disc) -> bool:
        """Whether a disc near an object can be it."""
        if not item.has_moved:
            return True
        was_lost = item.seen_at < self._before
        return item.is_like(disc) and not (was_lost and self._stood_before(disc, item))

    def _stood_before(self, disc: Disc, item: ObjectFilter) -> bool:
        """Whether a disc is something that has stood since before an object was seen last."""
        return self._places.since(disc.x, disc.y, STOOD) < item.seen_at

    def _lost(self) -> list[ObjectFilter]:
        """Return the moving objects that this scan has not updated."""
        return [item for item in self._filters if item.has_moved and item.seen_at < self._time]

    def _correct_manoeuvring(self, discs: list[Disc], taken: set[int]) -> set[int]:
        """Associate lost objects with discs of their size nearby: they have changed direction."""
        found: set[int] = set()
        for item in self._lost():
            near = [
                (item.away(disc), index)
                for index, disc in enumerate(discs)
                if index not in taken | found
                and item.is_like(disc)
                and not self._stood_before(disc, item)
            ]
            if near and min(near)[0] <= MANOEUVRE:
                index = min(near)[1]
                found.add(index)
                item.forget_velocity()
                self._correct_filter(item, discs[index])
        return found

    def _correct_by_surface(self, pose: Pose2D) -> None:
        """Correct lost objects by the returns nearest to their surface.

        One edge of the surface must be seen: along a wall, returns beside those that fit go on.
        """
        if not self._lost():
            return
        view, moving = self._views[-1], [item for item in self._filters if item.has_moved]
        ranges, returned = view.scan.ranges, np.isfinite(view.scan.ranges)
        if self._static is not None:
            returned &= ~self._on_map(pose, view.scan, returned)
        beams = np.flatnonzero(returned)
        points = view.ends(beams)
        off = points[:, None, :] - np.array([item.state[:2] for item in moving])
        radii = np.array([item.radius for item in moving])
        away = np.abs(np.hypot(off[..., 0], off[..., 1]) - radii)
        nearest = away.argmin(axis=1)
        for number, item in enumerate(moving):
            if item.seen_at == self._time or self._time - item.whole_at > PARTLY:
                continue
            spread = item.covariance[:2, :2]
            reach = 0.1 + min(3.0 * sqrt(np.linalg.eigvalsh(spread)[-1]), 0.5 * item.radius)
            own = (nearest == number) & (away[:, number] <= reach)
            if not own.any() or not has_edge(ranges, beams[own]):
                continue
            fit = surface_fit(points[own], item.state[:2], item.radius, spread, view.origin)
            if fit is not None:
                item.correct(*fit)
                item.seen_at = self._time

    def _note_absent(self) -> None:
        """Count the scans that saw through where a lost object should be."""
        view = self._views[-1]
        for item in self._filters:
            if item.seen_at == self._time:
                item.absent = 0
            elif item.is_seen_through(view):
                item.absent += 1

    def _variance(self, disc: Disc) -> float:
        """Return the variance of a disc's centre along each axis, m²."""
        factor = 1.0 if disc.is_circle else HIDDEN_NOISE
        return (factor * POSITION_NOISE) ** 2 + disc.deviation**2

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

    def _correct_filter(self, item: ObjectFilter, disc: Disc) -> None:
        """Correct a filter by a disc."""
        item.correct(np.array([disc.x, disc.y]), self._variance(disc) * np.eye(2))
        if disc.is_circle:
            item.correct_radius(disc.radius)
            item.whole_at = self._time
        item.hits, item.seen_at = item.hits + 1, self._time
        item.seen.append(Sighting(self._views[-1], disc.run))
        if not item.has_moved and self._moves(item):
            item.has_moved = True
            self._places.forget(*item.began)

    def _moves(self, item: ObjectFilter) -> bool:
        gone = hypot(item.state[0] - item.began[0], item.state[1] - item.began[1])
        return bool(
            item.hits >= self.parameters.confirm
            and item.speed >= MOVING_SPEED
            and gone >= MOVING_DISTANCE
            and self._left_its_ground(item)
        )

    def _left_its_ground(self, item: ObjectFilter) -> bool:
        """Whether it is where ground was seen free, or its old place is seen free now."""
        views = list(self._views)
        newest, oldest = item.seen[-1], item.seen[0]
        if newest.view.share_passed(oldest.view.points(oldest.run)) >= SHARE:
            return True
        points = newest.view.points(newest.run)
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
        """Add the object that a disc shows: one that was out of sight, or a new one."""
        variances = [POSITION_NOISE**2] * 2 + [FIRST_SPEED**2] * 2
        known = self._out_of_sight.take(disc, self._places.since(disc.x, disc.y, STOOD))
        self._filters.append(
            ObjectFilter(
                self._next_id if known is None else known.id,
                np.array([disc.x, disc.y, 0.0, 0.0]), np.diag(variances),
                disc.radius, (disc.x, disc.y), self._time,
                deque([Sighting(self._views[-1], disc.run)], maxlen=VIEWS), whole_at=self._time,
                has_moved=known is not None,
            )
        )  # fmt: skip
        self._next_id += known is None
        self._filters.sort(key=attrgetter("id"))


def _widened(cells: NDArray[np.bool_], by: int) -> NDArray[np.bool_]:
    """Return the cells within a distance (in cells) of a true one."""
    import cv2

    rows, columns = np.ogrid[-by : by + 1, -by : by + 1]
    disc = (np.hypot(rows, columns) <= by + 1e-9).astype(np.uint8)
    return cv2.dilate(cells.astype(np.uint8), disc).astype(np.bool_)
