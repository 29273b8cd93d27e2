"""Merging of two mapping runs by the places that both have seen.

Parts of the second map are searched on the whole first map. Each match implies where the second
map lies in the first one; the parts that agree vote for it. A placement is accepted if the walls of
neither map lie in the free space of the other one. The graphs are then joined by matches of their
keyframes and by the markers that both have seen, and optimised together. Within each map the edges
stay as they are.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from stack.drivetrain.description import LidarDescription
from stack.errors import InputError
from stack.localisation.distance_field import SignedDistanceField, surface_field
from stack.localisation.health import ScanEvaluator
from stack.localisation.planar import are_near
from stack.localisation.search.map_search import MapSearch
from stack.mapping.slam.graph import Edge, PoseGraph
from stack.mapping.slam.loops import LOOP_CONFLICT
from stack.mapping.slam.mapper import Mapper
from stack.mapping.slam.parameters import MapperParameters
from stack.mapping.slam.rendering.renderer import Drawing
from stack.optional_packages import GTSAM
from stack.types import Pose2D

PARTS = 40
"""Parts of the second map that are searched, at most; evenly spread over its keyframes."""

PART_SPACING, PART_RADIUS, PART_SCANS = 1.0, 3.0, 5
"""Metres between the middles of two parts; metres around one; scans of one."""

PART_MATCHES = 5
"""Places of a part that are considered, at most."""

AGREE_DISTANCE, AGREE_ANGLE = 0.4, 0.08
"""Metres and radians up to which two parts agree on the placement."""

LEAST_PARTS = 3
"""Parts that must agree."""

LEAST_POINTS = 300
"""Points of the second map that must lie at walls of the first one."""

TRIED = 6
"""Placements that are verified, at most."""

RIVAL_SHARE = 0.8
"""A second placement with this share of the best one's score makes the merge ambiguous."""

CONFLICT_WEIGHT = 5.0
"""Points at walls that one in free space outweighs: equal walls are common, lost ones rare."""

JOIN_DISTANCE, JOIN_EDGES = 2.0, 3
"""Metres between keyframes of the two maps that are matched; the nearest ones of each keyframe."""

LEAST_JOINTS = 3
"""Matches of keyframes that must join the maps."""

ROUNDS = 3
"""Rounds of matching and optimising; in each one keyframes come near enough for further matches."""


@dataclass(frozen=True, slots=True)
class Placement:
    """Where the second map lies in the first one.

    Attributes:
        pose: of the second map's frame, frame of the first map.
        parts: number of the parts that agree.
        points: of the second map that lie at walls of the first one.
        conflict: share of the points in the free space of the other map, the larger one of both.
    """

    pose: Pose2D
    parts: int
    points: int = 0
    conflict: float = 1.0

    @property
    def score(self) -> float:
        """Points at walls, less those in free space with their weight."""
        return self.points * (1.0 - CONFLICT_WEIGHT * self.conflict)


@dataclass(frozen=True, slots=True)
class Merged:
    """Result of a merge.

    Attributes:
        mapper: with the graph of both maps, optimised.
        placement: of the second map.
        joints: number of matches between keyframes of the two maps.
    """

    mapper: Mapper
    placement: Placement
    joints: int


def merge(first: PoseGraph, second: PoseGraph) -> Merged:
    """Merge the second graph into a copy of the first one, in the frame of the first one.

    Raises:
        InputError: the maps have no common place, or the second map fits in several ways.
    """
    GTSAM.require("merged maps need")
    for graph in (first, second):
        if not graph.keyframes:
            raise InputError("a pose graph without keyframes cannot be merged")
    placement = _placement(first, second)
    graph, added = _joined(first, second, placement.pose)
    mapper = Mapper(graph=graph, keep_trajectory=True)
    joints = _join(mapper, added)
    if joints < LEAST_JOINTS:
        raise InputError(
            f"the maps have no common place: only {joints} scans of the second map match scans of"
            f" the first one, {LEAST_JOINTS} are needed; map some rooms of the first map again"
        )
    return Merged(mapper, placement, joints)


def _placement(first: PoseGraph, second: PoseGraph) -> Placement:
    """Return the verified placement of the second map."""
    votes = _votes(second, surface_field(_drawn(first).grid()))
    ranked = sorted(
        (
            Placement(pose, _support(pose, at, votes))
            for at, placements in votes
            for pose in placements
        ),
        key=lambda placement: -placement.parts,
    )
    tried: list[Placement] = []
    for placement in ranked:
        if placement.parts < LEAST_PARTS or len(tried) == TRIED:
            break
        if all(not _agree(placement.pose, other.pose, Pose2D(0.0, 0.0)) for other in tried):
            tried.append(placement)
    verified = sorted(
        (found for found in (_compared(one, first, second) for one in tried)
         if found.conflict <= LOOP_CONFLICT and found.points >= LEAST_POINTS),
        key=lambda placement: -placement.score,
    )  # fmt: skip
    if not verified:
        most = max((placement.parts for placement in ranked), default=0)
        raise InputError(
            f"the maps have no common place: at most {most} of {len(votes)} parts of the"
            f" second map agree on a place in the first one, {LEAST_PARTS} are needed, and walls"
            " of neither map may lie in free space of the other; map a room of the first again"
        )
    best, *others = verified
    rival = next((o for o in others if o.score >= RIVAL_SHARE * best.score), None)
    if rival is not None:
        raise InputError(
            f"the second map fits in two ways: at ({best.pose.x:.1f}, {best.pose.y:.1f}) and at"
            f" ({rival.pose.x:.1f}, {rival.pose.y:.1f}) in the first map; map a room again that"
            " tells them apart"
        )
    return best


Votes = list[tuple[Pose2D, list[Pose2D]]]
"""Of each part: its middle in the second map, and the placements that its matches imply."""


def _votes(second: PoseGraph, field: SignedDistanceField) -> Votes:
    """Search the parts of the second map on the first one."""
    noise = LidarDescription.noise  # a saved graph does not name its lidar
    search = MapSearch(field, ScanEvaluator(field, noise), noise)
    mapper = Mapper(graph=second, keep_trajectory=True)
    middles: list[int] = []
    for number, keyframe in second.keyframes.items():
        away = (keyframe.pose.distance_to(second.keyframes[m].pose) for m in middles)
        if min(away, default=PART_SPACING) >= PART_SPACING:
            middles.append(number)
    step = max(1, -(-len(middles) // PARTS))
    found: Votes = []
    for middle in middles[::step]:
        here = second.keyframes[middle]
        near = mapper.neighbourhood.around(middle, here.pose, 10 * PART_SCANS, PART_RADIUS)
        spread = [n for n in near if n != middle][:: max(1, len(near) // PART_SCANS)]
        views = [
            (second.keyframes[n].pose.relative_to(here.pose), second.keyframes[n].scan)
            for n in spread[:PART_SCANS]
        ]
        matches = search.everywhere(here.scan, views)[:PART_MATCHES]
        found.append((here.pose, [m.pose.compose(here.pose.inverse()) for m in matches]))
    return found


def _support(pose: Pose2D, at: Pose2D, votes: Votes) -> int:
    """Return the number of parts with a match that implies the same placement."""
    return sum(
        any(_agree(pose, other, middle) and _agree(pose, other, at) for other in placements)
        for middle, placements in votes
    )


def _agree(one: Pose2D, other: Pose2D, at: Pose2D) -> bool:
    """Return whether two placements put a pose of the second map at the same place."""
    return are_near(one.compose(at), other.compose(at), AGREE_DISTANCE, AGREE_ANGLE)


def _drawn(graph: PoseGraph, placement: Pose2D | None = None) -> Drawing:
    drawing = Drawing(MapperParameters())
    for keyframe in graph.keyframes.values():
        pose = keyframe.pose if placement is None else placement.compose(keyframe.pose)
        drawing.draw(replace(keyframe, pose=pose))
    return drawing


def _compared(placement: Placement, first: PoseGraph, second: PoseGraph) -> Placement:
    """Return a placement with the agreement of the walls of both maps."""
    moved = {n: placement.pose.compose(k.pose) for n, k in second.keyframes.items()}
    before = {number: keyframe.pose for number, keyframe in first.keyframes.items()}
    at_walls, conflict = _fit(_drawn(first), second, moved)
    _, other = _fit(_drawn(second, placement.pose), first, before)
    return replace(placement, points=at_walls, conflict=max(conflict, other))


def _fit(drawing: Drawing, graph: PoseGraph, poses: dict[int, Pose2D]) -> tuple[int, float]:
    """Return the number of a graph's points at the walls of a drawing, and the share in space."""
    points = np.concatenate([
        poses[number].transform(keyframe.scan.points())
        for number, keyframe in graph.keyframes.items()
    ])  # fmt: skip
    return drawing.fit(points)


def _joined(first: PoseGraph, second: PoseGraph, placement: Pose2D) -> tuple[PoseGraph, list[int]]:
    """Return one graph with both maps, and the new ids of the second one's keyframes."""
    graph = PoseGraph()
    for keyframe in first.keyframes.values():
        graph.add_keyframe(keyframe)
    for edge in first.edges:
        graph.add_edge(edge)
    ids, sessions = first.next_id, 1 + max(k.session for k in first.keyframes.values())
    numbers = {number: ids + k for k, number in enumerate(sorted(second.keyframes))}
    for number, new in numbers.items():
        keyframe = second.keyframes[number]
        pose = placement.compose(keyframe.pose)
        graph.add_keyframe(
            replace(keyframe, id=new, pose=pose, session=keyframe.session + sessions)
        )
    for edge in second.edges:
        graph.add_edge(replace(edge, source=numbers[edge.source], target=numbers[edge.target]))
    for one, ids_of in ((first, {n: n for n in first.keyframes}), (second, numbers)):
        for key, landmark in one.landmarks.items():
            for number, seen in landmark.sightings.items():
                graph.add_sighting(key, landmark.size, ids_of[number], seen)
    return graph, list(numbers.values())


def _join(mapper: Mapper, added: list[int]) -> int:
    """Match keyframes of both maps, near the common places first; return how many match."""
    joints, known = 0, set(added)
    for _ in range(ROUNDS):
        edges = [e for e in _joints(mapper, known) if not _is_edge(mapper.graph, e)]
        for edge in edges:
            mapper.graph.add_edge(edge)
        joints += len(edges)
        if not joints:
            break
        mapper.optimise()
    return joints


def _joints(mapper: Mapper, added: set[int]) -> Iterable[Edge]:
    keyframes = mapper.graph.keyframes
    before = [number for number in keyframes if number not in added]
    rows = np.array([[keyframes[n].pose.x, keyframes[n].pose.y] for n in before])
    for number in sorted(added):
        pose = keyframes[number].pose
        away = np.hypot(rows[:, 0] - pose.x, rows[:, 1] - pose.y)
        for k in np.argsort(away, kind="stable")[:JOIN_EDGES].tolist():
            if away[k] > JOIN_DISTANCE:
                break
            edge = mapper.matched_edge(before[k], number, "loop")
            if edge is not None:
                yield edge


def _is_edge(graph: PoseGraph, edge: Edge) -> bool:
    return any(
        other.source == edge.source and other.target == edge.target
        for other in graph.edges_of(edge.source)
    )
