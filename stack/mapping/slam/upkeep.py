"""Upkeep of a map that is driven in again and again: what is new, out of date, or redundant.

A scan becomes a keyframe only where there are few keyframes yet, or where it sees something that
they do not. So the number of keyframes follows from the area and not from the time. A beam of a
keyframe that several later scans contradict is removed from it: it ended at a thing that is gone,
or passed where a thing stands now.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import pi
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stack.mapping.slam.graph import Keyframe, PoseGraph
from stack.mapping.slam.neighbourhood import REFERENCE_DISTANCE, Neighbourhood
from stack.types import FloatArray, Pose2D, Scan, wrap_angle

PLACE_KEYFRAMES = 3
"""Keyframes that are kept of one place; a scan that shows nothing new is not added."""
PLACE_DISTANCE = 0.5
"""Largest distance of keyframes of one place, m."""
PLACE_ANGLE = 0.6
"""Largest angle between keyframes of one place, if the lidar does not see all around, rad."""
CHANGE_BEAMS = 6
"""Beams that contradict the keyframes of a place in a scan with news."""
CHANGE_SCANS = 3
"""Scans at different poses that must contradict a beam of a keyframe before the map forgets it."""

CONTRADICTED_SHARE = 0.4
"""Share of the known points in view that a scan at a wrong pose sees through; else hardly any."""

RECENT = 12
"""Newest keyframes, which are neither changed nor removed: loop closure needs them."""

COMPARED = 30
"""Keyframes near the pose with which a scan is compared."""

MARGIN, MARGIN_SHARE = 0.2, 0.03
"""Metres, and share of the distance, by which a beam must pass a point to contradict it."""

FULL_CIRCLE = 1.9 * pi
"""Radians: a lidar with this field of view sees the same at any heading."""


@dataclass(frozen=True, slots=True)
class Findings:
    """Result of the comparison of a scan with the keyframes around it.

    Attributes:
        is_wanted: whether the scan is to become a keyframe.
        changed: ids of keyframes that have lost beams.
        surplus: ids of keyframes that are to be removed.
    """

    is_wanted: bool
    changed: tuple[int, ...]
    surplus: tuple[int, ...]


class MapUpkeep:
    """Compares scans with the keyframes around them.

    Args:
        graph: whose keyframes lose outdated beams.
        neighbourhood: of the same graph.
    """

    def __init__(self, graph: PoseGraph, neighbourhood: Neighbourhood) -> None:
        self._graph, self._neighbourhood = graph, neighbourhood
        self._votes: dict[int, NDArray[np.int8]] = {}
        self._prepared: dict[int, ScanBeams] = {}

    def compare(self, start: int, pose: Pose2D, scan: Scan) -> Findings:
        """Compare a scan with the keyframes around it; remove beams from them.

        Args:
            start: id of the keyframe that the scan was matched with.
            pose: of the base at the scan, map frame.
            scan: deskewed.
        """
        near = self._neighbourhood.around(start, pose, COMPARED, REFERENCE_DISTANCE)
        place = {number for number in near if self._is_same_place(pose, scan, number)}
        newest = self._graph.next_id - RECENT
        new, changed, beams = 0, [], ScanBeams.of(scan)
        for number in near:
            keyframe = self._graph.keyframes[number]
            against = contradicted(self._beams(keyframe), keyframe.pose, beams, pose)
            if number in place:
                new = max(new, int(np.count_nonzero(against)))
            if number < newest and self._remove_beams(keyframe, against):
                changed.append(number)
        is_full = len(place) >= PLACE_KEYFRAMES
        is_wanted = not is_full or new >= CHANGE_BEAMS
        spare = len(place) + is_wanted - PLACE_KEYFRAMES
        removable = [number for number in place if number < newest and number != start]
        removable.sort(key=lambda number: (self._valid(number), -number))
        surplus = tuple(removable[: max(0, spare)])
        return Findings(is_wanted, tuple(n for n in changed if n not in surplus), surplus)

    def contradicts(self, near: Sequence[int], pose: Pose2D, scan: Scan) -> bool:
        """Return whether a scan sees through the walls of the keyframes around a pose, if any."""
        beams, passed, again = ScanBeams.of(scan), 0, 0
        for number in near:
            keyframe = self._graph.keyframes[number]
            through, seen = seen_through(self._beams(keyframe), keyframe.pose, beams, pose)
            passed, again = passed + through, again + seen
        return not near or passed > CONTRADICTED_SHARE * (passed + again)

    def forget(self, keyframe: int) -> None:
        """Drop what is stored of a removed keyframe."""
        self._votes.pop(keyframe, None)
        self._prepared.pop(keyframe, None)

    def _beams(self, keyframe: Keyframe) -> ScanBeams:
        """Return the scan of a keyframe, prepared once until it loses beams."""
        prepared = self._prepared.get(keyframe.id)
        if prepared is None or prepared.scan is not keyframe.scan:
            prepared = self._prepared[keyframe.id] = ScanBeams.of(keyframe.scan)
        return prepared

    def _is_same_place(self, pose: Pose2D, scan: Scan, number: int) -> bool:
        other = self._graph.keyframes[number].pose
        if pose.distance_to(other) > PLACE_DISTANCE:
            return False
        if abs(scan.angle_increment) * scan.ranges.size >= FULL_CIRCLE:
            return True
        return abs(wrap_angle(pose.heading - other.heading)) <= PLACE_ANGLE

    def _valid(self, number: int) -> int:
        """Return the number of valid beams of a keyframe."""
        return int(np.count_nonzero(~np.isnan(self._graph.keyframes[number].scan.ranges)))

    def _remove_beams(self, keyframe: Keyframe, against: NDArray[np.bool_]) -> bool:
        """Count a scan that contradicts beams; return whether some were removed."""
        if not against.any():
            return False
        votes = self._votes.setdefault(keyframe.id, np.zeros(against.size, np.int8))
        votes[against] += 1
        gone = votes >= CHANGE_SCANS
        if not gone.any():
            return False
        votes[gone] = 0
        ranges = np.where(gone, np.float32(np.nan), keyframe.scan.ranges)
        self._graph.set_scan(keyframe.id, replace(keyframe.scan, ranges=ranges))
        return True


@dataclass(frozen=True, slots=True)
class ScanBeams:
    """A scan prepared for comparisons with others.

    Attributes:
        scan: itself.
        ended: (m,) numbers of the beams that returned.
        points: (m, 2) where these end, sensor frame, metres.
        least: (n,) metres that a beam and both beside it pass. One without return passes everything
            up to the range limit, an invalid one nothing.
    """

    scan: Scan
    ended: NDArray[np.intp]
    points: FloatArray
    least: FloatArray

    @staticmethod
    def of(scan: Scan) -> ScanBeams:
        """Prepare a scan."""
        ended = np.flatnonzero(np.isfinite(scan.ranges))
        angles, away = scan.angles[ended], scan.ranges[ended].astype(np.float64)
        ranges = np.where(np.isnan(scan.ranges), 0.0, np.minimum(scan.ranges, scan.range_max))
        least = np.minimum(ranges, np.minimum(np.roll(ranges, 1), np.roll(ranges, -1)))
        points = np.column_stack([away * np.cos(angles), away * np.sin(angles)])
        return ScanBeams(scan, ended, points, least)

    def passed(self, points: FloatArray) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
        """Return the beam that points at each point (m, 2), sensor frame, and if it passes it.

        The beams beside it must pass the point too: at an edge the right beam is uncertain.
        """
        scan = self.scan
        distances = np.hypot(points[:, 0], points[:, 1])
        turned = np.arctan2(points[:, 1], points[:, 0]) - scan.angle_min
        step, count = scan.angle_increment, scan.ranges.size
        is_circle = abs(step) * count >= FULL_CIRCLE
        beams: Any = np.rint((turned % (2.0 * pi if step > 0.0 else -2.0 * pi)) / step)
        beams = beams.astype(np.intp)
        inside = (beams >= 1) & (beams < count - 1) | is_circle
        beams = beams % count
        passed = self.least[beams] > distances * (1.0 + MARGIN_SHARE) + MARGIN
        return beams, inside & passed


def seen_through(old: ScanBeams, base: Pose2D, new: ScanBeams, pose: Pose2D) -> tuple[int, int]:
    """Return how many points of an old scan at a base pose a new one at a pose sees through, and
    how many it sees again. What stands before them says nothing.
    """  # noqa: D205
    then, now = base.compose(old.scan.mount), pose.compose(new.scan.mount)
    points = now.inverse().transform(then.transform(old.points))
    beams, passed = new.passed(points)
    distances = np.hypot(points[:, 0], points[:, 1])
    again = np.abs(new.scan.ranges[beams] - distances) <= MARGIN + MARGIN_SHARE * distances
    return int(np.count_nonzero(passed)), int(np.count_nonzero(again & ~passed))


def contradicted(old: ScanBeams, base: Pose2D, new: ScanBeams, pose: Pose2D) -> NDArray[np.bool_]:
    """Return (n,) the beams of an old scan at a base pose that a new one at a pose contradicts.

    The new scan sees beyond the point at which a beam ended, or sees a point on the way to it.
    """
    then, now = base.compose(old.scan.mount), pose.compose(new.scan.mount)
    against = np.zeros(old.scan.ranges.size, np.bool_)
    _, passed = new.passed(now.inverse().transform(then.transform(old.points)))
    against[old.ended[passed]] = True
    beams, passed = old.passed(then.inverse().transform(now.transform(new.points)))
    against[beams[passed]] = True
    return against
