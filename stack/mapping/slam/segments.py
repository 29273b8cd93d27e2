"""Loops over segments: the scans of some metres driven, matched with those of earlier visits.

One scan in a corridor fits at many places. The scans of some metres fit at few, and segments in a
row at one: a loop is closed when several of them agree, better than on any other place. Where a
place is searched follows from the covariance of the poses along the graph.

W. Hess et al., "Real-Time Loop Closure in 2D LIDAR SLAM", ICRA 2016 (the search); J. Mangelson et
al., "Pairwise Consistent Measurement Set Maximization", ICRA 2018 (the agreement).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import hypot, pi, sqrt

import numpy as np

from stack.localisation.planar import are_near
from stack.mapping.slam.graph import PoseGraph
from stack.mapping.slam.matching.local_map import LocalMap, ScanMatch
from stack.mapping.slam.matching.scans import PreparedScan
from stack.mapping.slam.neighbourhood import Neighbourhood
from stack.mapping.slam.path_covariance import PathCovariance
from stack.types import FloatArray, Pose2D

LENGTH, SPACING = 12.0, 5.0
"""Metres driven along a segment, and from one to the next."""

NEAR_PATH = 14.0
"""Metres along the edges: segments nearer than this are neighbours, not loops."""

LEAST_KEYFRAMES = 4
"""Of a segment that are still in the graph."""

CELL = 0.1
"""Metres: of the search, and of the points of a segment."""

RANGE = 15.0
"""Metres: longer ranges are not part of a segment; its neighbours see those walls better."""

DEVIATIONS, WIDEST = 3.0, 40.0
"""Half width of the search in standard deviations of the relative pose, and at most, in metres."""

CANDIDATES = 24
"""Earlier segments that one is compared with, at most: the most probable ones."""

SCORE, OVERLAP = 0.55, 0.5
"""Of a match: of the search, and the share of its points that lie at walls."""

POOL = 60.0
"""Metres driven for which matches are kept to be compared with others."""

AGREEING, SPAN = 3, 8.0
"""Segments that must agree on a loop, and the metres driven along which they lie."""

AGREE_DISTANCE, AGREE_DRIFT, AGREE_ANGLE = 0.3, 0.03, 0.08
"""Two matches agree if their loop closes within so many metres, with so many more for each metre
between them, and radians."""

RIVAL = 0.8
"""Matches that agree on another place with this share of the score leave it open."""


@dataclass(frozen=True, slots=True)
class Segment:
    """Keyframes of some metres driven.

    Attributes:
        keyframes: ids, in order; some may have been removed from the graph since.
        driven: metres from the beginning of the session to its end.
    """

    keyframes: tuple[int, ...]
    driven: float


@dataclass(frozen=True, slots=True)
class SegmentMatch:
    """A match of a segment with an earlier one.

    Attributes:
        keyframe: id in the middle of the segment.
        place: id in the middle of the earlier one.
        driven: metres to the end of the segment.
        match: of its points; the pose is that of `keyframe` in the frame of `place`.
    """

    keyframe: int
    place: int
    driven: float
    match: ScanMatch

    @property
    def score(self) -> float:
        """Share of the points that lie at walls."""
        return self.match.overlap


class SegmentLoops:
    """Segments of a graph, and the matches between them."""

    def __init__(
        self,
        graph: PoseGraph,
        neighbourhood: Neighbourhood,
        prepared: Callable[[int], PreparedScan],
    ) -> None:
        self._graph, self._neighbourhood, self._prepared = graph, neighbourhood, prepared
        self._paths = PathCovariance(graph)
        self._segments: list[Segment] = []
        self._recent: deque[tuple[int, float]] = deque()
        self._driven = self._next = 0.0
        self._queue: deque[tuple[Segment, Segment, float, float]] = deque()
        self._pool: deque[SegmentMatch] = deque()
        self._maps: dict[int, LocalMap] = {}
        self._scans: dict[int, PreparedScan] = {}

    def find(self, keyframe: int) -> list[SegmentMatch]:
        """Take a new keyframe; return the matches of a loop that is verified by it."""
        self._extend(keyframe)
        if not self._queue:
            return []
        found = self._compare(*self._queue.popleft())
        if found is None:
            return []
        while self._pool and self._pool[0].driven < found.driven - POOL:
            self._pool.popleft()
        self._pool.append(found)
        verified = self._verified(found)
        if verified:
            self._queue.clear()  # the next segments lie in narrower windows
        return verified

    def forget(self, keyframe: int) -> None:
        """Drop what depends on a keyframe that is removed from the graph."""
        self._maps.pop(keyframe, None)
        self._pool = deque(one for one in self._pool if keyframe not in (one.keyframe, one.place))
        self._recent = deque(one for one in self._recent if one[0] != keyframe)

    def _extend(self, keyframe: int) -> None:
        """Measure the way; end a segment after some metres. None goes over doubtful odometry."""
        keyframes = self._graph.keyframes
        if any(edge.is_doubtful for edge in self._graph.edges_of(keyframe)):
            self._recent.clear()
            self._next = self._driven + LENGTH
        if self._recent:
            moved = keyframes[keyframe].pose.distance_to(keyframes[self._recent[-1][0]].pose)
            self._driven += moved
        self._recent.append((keyframe, self._driven))
        while self._driven - self._recent[0][1] > LENGTH:
            self._recent.popleft()
        if self._driven < max(self._next, LENGTH):
            return
        self._next = self._driven + SPACING
        new = Segment(tuple(number for number, _ in self._recent), self._driven)
        self._segments = [one for one in self._segments if self._middle(one) is not None]
        self._seek(new)
        self._segments.append(new)

    def _middle(self, segment: Segment) -> int | None:
        """Return the keyframe in the middle of a segment; None if too few are left of it."""
        left = [number for number in segment.keyframes if number in self._graph.keyframes]
        return left[len(left) // 2] if len(left) >= LEAST_KEYFRAMES else None

    def _seek(self, new: Segment) -> None:
        """Queue the comparisons with earlier segments that may be near."""
        keyframes, middle = self._graph.keyframes, self._middle(new)
        if middle is None:
            return
        paths = self._paths.from_keyframe(middle)
        joined = self._neighbourhood.within_path(middle, NEAR_PATH)
        here, found = keyframes[middle].pose, []
        for segment in self._segments:
            place = self._middle(segment)
            if place is None or place in joined:
                continue
            row = int(np.searchsorted(paths.numbers, place))
            away = here.distance_to(keyframes[place].pose)
            position, heading = _deviations(paths.covariances[row], away)
            if np.isfinite(paths.costs[row]) and away <= DEVIATIONS * position + SPACING:
                found.append((away / position, segment, position, heading))
        found.sort(key=lambda one: one[0])
        self._queue.extend((new, *one[1:]) for one in found[:CANDIDATES])

    def _compare(
        self, new: Segment, earlier: Segment, position: float, heading: float
    ) -> SegmentMatch | None:
        """Search a segment around an earlier one."""
        keyframe, place = self._middle(new), self._middle(earlier)
        if keyframe is None or place is None:
            return None
        poses = self._graph.keyframes
        start = poses[keyframe].pose.relative_to(poses[place].pose)
        local, scan = self._map_of(place, earlier), self._scan_of(keyframe, new)
        window = (min(DEVIATIONS * position + 0.2, WIDEST), min(DEVIATIONS * heading + 0.05, pi))
        placed = local.search(scan, start, window, deviations=(position, heading), least=SCORE)
        if placed is None:
            return None
        match = local.align(scan, placed)
        if match.overlap < OVERLAP or match.pose.distance_to(placed) > 2.0 * CELL:
            return None
        return SegmentMatch(keyframe, place, new.driven, match)

    def _verified(self, new: SegmentMatch) -> list[SegmentMatch]:
        """Return the matches that agree with a new one, if they outdo all that do not."""
        best = self._agreeing(new)
        if len(best) < AGREEING or best[-1].driven - best[0].driven < SPAN:
            return []
        segments = {one.keyframe for one in best}
        rivals = [
            one for one in self._pool
            if one.keyframe in segments and not self._agree(one, new)
        ]  # fmt: skip
        most = max(
            (sum(r.score for r in self._agreeing(one) if r.keyframe in segments)
             for one in rivals),
            default=0.0,
        )  # fmt: skip
        if most > RIVAL * sum(one.score for one in best):
            return []
        self._pool = deque(one for one in self._pool if one.keyframe not in segments)
        return best

    def _agreeing(self, match: SegmentMatch) -> list[SegmentMatch]:
        """Return one match of each segment that agrees with a match, itself among them."""
        found = {match.keyframe: match}
        for one in sorted(self._pool, key=lambda one: -one.score):
            if one.keyframe not in found and all(
                self._agree(one, other) for other in found.values()
            ):
                found[one.keyframe] = one
        return sorted(found.values(), key=lambda one: one.driven)

    def _agree(self, one: SegmentMatch, other: SegmentMatch) -> bool:
        """Return whether the loop over two matches closes."""
        keyframes = self._graph.keyframes
        poses = [keyframes[n].pose for m in (one, other) for n in (m.keyframe, m.place)]
        moved = poses[2].relative_to(poses[0])
        back = poses[3].relative_to(poses[1])
        around = one.match.pose.inverse().compose(back).compose(other.match.pose)
        length = hypot(moved.x, moved.y) + hypot(back.x, back.y)
        return are_near(around, moved, AGREE_DISTANCE + AGREE_DRIFT * length, AGREE_ANGLE)

    def _map_of(self, middle: int, segment: Segment) -> LocalMap:
        if middle not in self._maps:
            if len(self._maps) > 2 * CANDIDATES:
                self._maps.pop(next(iter(self._maps)))
            self._maps[middle] = LocalMap(self._parts(middle, segment), CELL, wide=True)
        return self._maps[middle]

    def _scan_of(self, middle: int, segment: Segment) -> PreparedScan:
        if middle not in self._scans:
            self._scans = {middle: _merged(self._parts(middle, segment))}
        return self._scans[middle]

    def _parts(self, middle: int, segment: Segment) -> list[tuple[Pose2D, PreparedScan]]:
        """Return the scans of a segment, each with its pose in the frame of the middle."""
        keyframes = self._graph.keyframes
        centre = keyframes[middle].pose
        return [
            (keyframes[n].pose.relative_to(centre), _near(self._prepared(n)))
            for n in segment.keyframes
            if n in keyframes
        ]


def _deviations(covariance: FloatArray, away: float) -> tuple[float, float]:
    """Return the deviations (m, rad) of a relative pose that is `away` metres long."""
    position = float(np.linalg.eigvalsh(covariance[:2, :2])[-1])
    turn = float(covariance[2, 2])
    return sqrt(position + turn * away**2) + 0.05, sqrt(turn) + 0.01


def _near(scan: PreparedScan) -> PreparedScan:
    """Return the points of a scan up to RANGE."""
    near = np.hypot(*(scan.points - scan.sensor).T) <= RANGE
    return PreparedScan(
        np.ascontiguousarray(scan.points[near]), np.ascontiguousarray(scan.normals[near]),
        np.ascontiguousarray(scan.bearings[near]), scan.sensor, scan.deviation,
    )  # fmt: skip


def _merged(parts: Sequence[tuple[Pose2D, PreparedScan]]) -> PreparedScan:
    """Return the points of scans as those of one, one in each cell; its bearings are not used."""
    points = np.concatenate([pose.transform(scan.points) for pose, scan in parts])
    normals = np.concatenate([
        Pose2D(0.0, 0.0, pose.heading).transform(scan.normals) for pose, scan in parts
    ])  # fmt: skip
    cells = np.floor(points / CELL).astype(np.int64)
    first = np.sort(np.unique(cells, axis=0, return_index=True)[1])
    return PreparedScan(
        np.ascontiguousarray(points[first]), np.ascontiguousarray(normals[first]),
        np.zeros(first.size), np.zeros(2), parts[0][1].deviation,
    )  # fmt: skip
