"""Loop closure: finds earlier visits of a place and verifies them with several scans."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from stack.localisation.planar import are_near
from stack.mapping.slam.graph import Edge, PoseGraph
from stack.mapping.slam.matching.local_map import (
    EDGE_OVERLAP,
    LocalMap,
    ScanMatch,
    align_pair,
)
from stack.mapping.slam.matching.scans import PreparedScan
from stack.mapping.slam.neighbourhood import REFERENCE_DISTANCE, REFERENCE_KEYFRAMES, Neighbourhood
from stack.mapping.slam.parameters import MapperParameters
from stack.mapping.slam.rendering.renderer import Drawing
from stack.mapping.slam.segments import SegmentLoops
from stack.types import FloatArray, Pose2D

LOOP_DISTANCE = 6.0
"""Keyframes within this distance are candidates of a loop closure, m."""
LOOP_DRIFT = 0.03
"""Position error per metre driven that the search for loops allows for, m/m."""
LOOP_ANGLE = 0.5
"""Largest heading error of that search, rad."""
LOOP_SCORE = 0.6
"""Score of a scan, in [0, 1], that a loop closure needs."""
LOOP_OVERLAP = 0.65
"""Share of a scan's points that a loop closure explains."""
LOOP_SCANS = 3
"""Keyframes in a row that must agree on a loop closure."""
LOOP_LENGTH = 1.0
"""Distance driven while they agree, at least, m."""
LOOP_CONFLICT = 0.1
"""Share of the newest points that may lie in space which was free before."""
LOOP_SUPPORT = 0.5
"""Share of the newest points that must lie at its walls."""

NEAR_PATH = 12.0
"""Metres along the edges: keyframes nearer than this are neighbours, not loops."""

MOST_PLACES = 6
"""Places of which the nearest and the oldest are compared: the oldest corrects most."""

RECENT = 8
"""Keyframes before the newest one whose points must fit into the earlier map."""

AGREE_DISTANCE, AGREE_ANGLE = 0.25, 0.06
"""Metres and radians within which the corrections of several keyframes agree."""

LEAST_POINTS = 5.0
"""Points that must hold a match in its weakest direction: a corridor without ends has none."""

LOOP_FLOOR = np.diag([0.02, 0.02, 0.005]) ** 2
"""Covariance added to that of a match over a loop."""

SEGMENT_FLOOR = np.diag([0.1, 0.1, 0.02]) ** 2
"""As above, of segments: they have drifted themselves."""


@dataclass(frozen=True, slots=True)
class LoopMatch:
    """A match of a keyframe with an earlier place.

    Attributes:
        keyframe: id of the newer keyframe.
        place: id of the earlier one.
        relative: pose of the newer one in the frame of the earlier one.
        match: with the local map around the place.
    """

    keyframe: int
    place: int
    relative: Pose2D
    match: ScanMatch


class LoopClosure:
    """Looks for loops at each new keyframe; adds verified ones as edges.

    A loop is accepted if the matches of several keyframes in a row imply the same correction. A
    repeated structure, as two equal rooms, seldom passes that; if it does, the robust optimiser
    rejects its edges.
    """

    def __init__(
        self,
        parameters: MapperParameters,
        graph: PoseGraph,
        neighbourhood: Neighbourhood,
        prepared: Callable[[int], PreparedScan],
    ) -> None:
        self._parameters, self._graph = parameters, graph
        self._neighbourhood, self._prepared = neighbourhood, prepared
        self._segments = SegmentLoops(graph, neighbourhood, prepared)
        self._travelled: dict[int, float] = {}
        self._recent: deque[LoopMatch] = deque(maxlen=3 * LOOP_SCANS)

    def configure(self, parameters: MapperParameters) -> None:
        """Apply new parameters to the next keyframes."""
        self._parameters = parameters

    def find(self, keyframe: int) -> bool:
        """Compare a new keyframe with earlier places; return whether a loop was closed."""
        self._measure(keyframe)
        while self._recent and self._recent[0].keyframe < keyframe - 2 * LOOP_SCANS:
            self._recent.popleft()
        closed = False
        for match in self._segments.find(keyframe):
            information = _with_floor(match.match.information, SEGMENT_FLOOR)
            self._graph.add_edge(Edge(
                match.place, match.keyframe, match.match.pose, information, "loop"
            ))  # fmt: skip
            closed = True
        for place in self._places(keyframe):
            loop = self._compare(keyframe, place)
            if loop is None:
                continue
            agreeing = [h for h in self._recent if self._agree(h, loop)]
            self._recent.append(loop)
            if self._is_verified(loop, agreeing):
                for accepted in (*agreeing, loop):
                    self._add(accepted)
                    self._recent.remove(accepted)
                closed = True
        return closed

    def forget(self, keyframe: int) -> None:
        """Drop the matches with a keyframe that is removed from the graph."""
        self._travelled.pop(keyframe, None)
        self._segments.forget(keyframe)
        kept = [h for h in self._recent if keyframe not in (h.keyframe, h.place)]
        self._recent = deque(kept, maxlen=self._recent.maxlen)

    def _is_verified(self, loop: LoopMatch, agreeing: list[LoopMatch]) -> bool:
        """Return whether enough keyframes agree and the newest scans fit into the earlier map."""
        keyframe = loop.keyframe
        if len({h.keyframe for h in agreeing} | {keyframe}) < LOOP_SCANS:
            return False
        first = min((h.keyframe for h in agreeing), default=keyframe)
        moved = self._travelled[keyframe] - self._travelled[first]
        if moved < LOOP_LENGTH and keyframe - first < 2 * LOOP_SCANS:
            return False
        conflict, support = self._fit(loop)
        return conflict <= LOOP_CONFLICT and support >= LOOP_SUPPORT

    def _fit(self, loop: LoopMatch) -> tuple[float, float]:
        """Return how the newest points fit into the earlier map.

        Returns:
            Share of those in known space that lie where it was seen free, and share of all that
            lie at walls.
        """
        p, keyframes = self._parameters, self._graph.keyframes
        centre, newest = keyframes[loop.place].pose, keyframes[loop.keyframe].pose
        drawing = Drawing(p)
        near = self._neighbourhood.around(
            loop.place, centre, 2 * REFERENCE_KEYFRAMES, REFERENCE_DISTANCE
        )
        for number in near:
            pose = keyframes[number].pose.relative_to(centre)
            drawing.draw(replace(keyframes[number], pose=pose))
        recent = range(loop.keyframe - RECENT, loop.keyframe + 1)
        points = np.concatenate([
            loop.relative.compose(keyframes[n].pose.relative_to(newest)).transform(
                self._prepared(n).points
            )
            for n in recent
            if n in keyframes
        ])  # fmt: skip
        walls, conflict = drawing.fit(points)
        return conflict, walls / max(1, len(points))

    def _measure(self, keyframe: int) -> None:
        before = self._travelled.get(keyframe - 1, 0.0)
        here, last = self._graph.keyframes[keyframe], self._graph.keyframes.get(keyframe - 1)
        self._travelled[keyframe] = before + (here.pose.distance_to(last.pose) if last else 0.0)

    def _radius(self, keyframe: int, place: int) -> float:
        """Return the position error, metres, that the search allows for."""
        since = self._travelled[keyframe] - self._travelled.get(place, 0.0)
        return min(LOOP_DISTANCE, 0.5 + LOOP_DRIFT * abs(since))

    def _places(self, keyframe: int) -> list[int]:
        """Return the nearest and the oldest keyframe of earlier visits; they may be the same."""
        keyframes = self._graph.keyframes
        pose = keyframes[keyframe].pose
        numbers, x, y = self._graph.places.T
        away = np.hypot(x - pose.x, y - pose.y)
        near = [
            (float(away[row]), int(numbers[row]))
            for row in np.flatnonzero(away <= LOOP_DISTANCE + 1.0)
            if away[row] <= self._radius(keyframe, int(numbers[row])) + 1.0
        ]
        if len(near) < 2:
            return []
        joined = self._neighbourhood.within_path(keyframe, NEAR_PATH)
        places: list[int] = []
        for _, number in sorted(near):
            if number in joined:
                continue
            places.append(number)
            if len(places) == MOST_PLACES:
                break
            joined |= self._neighbourhood.within_path(number, NEAR_PATH)
        return list(dict.fromkeys((places[0], min(places)))) if places else []

    def _compare(self, keyframe: int, place: int) -> LoopMatch | None:
        """Match a keyframe with the surroundings of an earlier one."""
        p, keyframes = self._parameters, self._graph.keyframes
        centre = keyframes[place].pose
        near = self._neighbourhood.around(place, centre, REFERENCE_KEYFRAMES, REFERENCE_DISTANCE)
        scans = [(keyframes[n].pose.relative_to(centre), self._prepared(n)) for n in near]
        local = LocalMap(scans, p.resolution)
        scan = self._prepared(keyframe)
        start = keyframes[keyframe].pose.relative_to(centre)
        window = (self._radius(keyframe, place), LOOP_ANGLE)
        likely = (0.5 * window[0], 0.5 * window[1])
        found = local.search(scan, start, window, deviations=likely, least=LOOP_SCORE)
        if found is None:
            return None
        match = local.align(scan, found)
        if match.overlap < LOOP_OVERLAP or match.pose.distance_to(found) > 0.3:
            return None
        weakest = float(np.linalg.eigvalsh(match.information[:2, :2])[0])
        if weakest < LEAST_POINTS / scan.deviation**2:
            return None
        return LoopMatch(keyframe, place, match.pose, match)

    def _agree(self, one: LoopMatch, other: LoopMatch) -> bool:
        """Return whether two matches imply the same motion between the two keyframes."""
        keyframes = self._graph.keyframes
        if one.keyframe == other.keyframe:
            return False
        moved = keyframes[other.keyframe].pose.relative_to(keyframes[one.keyframe].pose)
        first = keyframes[one.place].pose.compose(one.relative)
        second = keyframes[other.place].pose.compose(other.relative)
        return are_near(second.relative_to(first), moved, AGREE_DISTANCE, AGREE_ANGLE)

    def _add(self, loop: LoopMatch) -> None:
        """Add the edge of a verified match."""
        pair = align_pair(
            self._prepared(loop.place), self._prepared(loop.keyframe),
            loop.relative,
        )  # fmt: skip
        match = loop.match
        if pair.overlap >= EDGE_OVERLAP and pair.pose.distance_to(loop.relative) < 0.1:
            match = pair
        information = _with_floor(match.information, LOOP_FLOOR)
        self._graph.add_edge(Edge(loop.place, loop.keyframe, match.pose, information, "loop"))


def _with_floor(information: FloatArray, floor: FloatArray) -> FloatArray:
    """Return the information after a covariance is added."""
    softer: FloatArray = information @ np.linalg.inv(np.eye(3) + floor @ information)
    return 0.5 * (softer + softer.T)
