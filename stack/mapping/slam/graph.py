"""Pose graph: keyframes with their scans, and relative poses between them.

The frame of the poses is the map frame. An edge from i to j measures the pose of keyframe j in the
frame of keyframe i. Its error is the estimated relative pose in the frame of the measured one, in
the order x, y, heading, weighted by the information matrix (R. Kümmerle et al., "g2o: A General
Framework for Graph Optimization", ICRA 2011). Fiducial markers that were seen at keyframes are
landmarks of the graph.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from stack.errors import ParameterError
from stack.localisation.planar import lever, rotation
from stack.types import FloatArray, Pose2D, RelativePose, Scan

EdgeKind = Literal["odometry", "match", "loop", "marker"]
EDGE_KINDS: tuple[EdgeKind, ...] = ("odometry", "match", "loop")
"""Kinds between keyframes. An edge of kind "marker" leads to a landmark; it follows from the
sightings and is not stored."""

DOUBTFUL_HEADING = 0.5
"""Radians: deviation of odometry that was wrong."""

LEAST_INFORMATION = 1e-4 * np.eye(3)
"""Of an edge, that of 100 m and 100 rad: a scan in a corridor tells nothing along it."""

LONGEST_LINK = 10.0
"""Seconds over which odometry links an earlier pose to a keyframe."""

LandmarkKey = tuple[str, int]
"""Dictionary and number of a marker."""


@dataclass(frozen=True, slots=True)
class Keyframe:
    """A scan that is kept, and where it was taken.

    Attributes:
        id: number, increasing with the time of creation; never used twice in a graph.
        stamp: of the scan, seconds on the body's clock.
        pose: of the base at the stamp, map frame; the optimiser changes it.
        odometry: of the base at the stamp, odom frame of the run.
        scan: with mount and range limits; `scan.points()` are the end points in the base frame.
        session: number of the mapping run, from 0; odometry connects keyframes of a session only.
    """

    id: int
    stamp: float
    pose: Pose2D
    odometry: Pose2D
    scan: Scan
    session: int = 0


@dataclass(frozen=True, slots=True)
class Edge:
    """A measured pose of one keyframe relative to another one.

    Attributes:
        source: id of the keyframe in whose frame `relative` is.
        target: id of the other keyframe.
        relative: pose of the target in the frame of the source.
        information: (3, 3) inverse covariance in the order x, y, heading; metres and radians.
        kind: "odometry", "match" (scans of neighbours) or "loop" (scans of an earlier visit); the
            optimiser may reject loop edges and edges to landmarks ("marker").
    """

    source: int
    target: int
    relative: Pose2D
    information: FloatArray
    kind: EdgeKind

    @property
    def covariance(self) -> FloatArray:
        """(3, 3) covariance in the order x, y, heading; finite where nothing is known."""
        covariance: FloatArray = np.linalg.inv(self.information + LEAST_INFORMATION).astype(
            np.float64
        )
        return covariance

    @property
    def is_doubtful(self) -> bool:
        """Whether it is odometry that does not know the heading: its ends are no neighbours."""
        return self.kind == "odometry" and self.information[2, 2] < DOUBTFUL_HEADING**-2


@dataclass(frozen=True, slots=True)
class Sighting:
    """A marker seen at a keyframe.

    Attributes:
        candidates: possible poses of the marker in the frame of the keyframe, with covariances in
            the axes of that frame; the most probable first.
        height: of the marker above the floor, metres.
    """

    candidates: tuple[RelativePose, ...]
    height: float

    @property
    def variance(self) -> float:
        """Variance of the position of the most probable pose, square metres."""
        return float(np.trace(self.candidates[0].covariance[:2, :2]))


@dataclass(slots=True)
class Landmark:
    """A fiducial marker as a node of the graph.

    Attributes:
        size: side of its black square, metres.
        sightings: by id of the keyframe, one for each.
        pose: of its centre and outward normal, map frame; None until the optimiser has placed it.
    """

    size: float
    sightings: dict[int, Sighting] = field(default_factory=dict)
    pose: Pose2D | None = None

    @property
    def height(self) -> float:
        """Mean height of the sightings, weighted by their information, metres."""
        weights = [1.0 / sighting.variance for sighting in self.sightings.values()]
        heights = [sighting.height for sighting in self.sightings.values()]
        return float(np.average(heights, weights=weights))


@dataclass(slots=True)
class PoseGraph:
    """Keyframes by id, edges in the order of their creation, and landmarks."""

    keyframes: dict[int, Keyframe] = field(default_factory=dict)
    edges: list[Edge] = field(default_factory=list)
    landmarks: dict[LandmarkKey, Landmark] = field(default_factory=dict)
    _edges_of: dict[int, list[Edge]] = field(default_factory=dict, repr=False)
    _places: FloatArray | None = field(default=None, repr=False)

    @property
    def next_id(self) -> int:
        """Id of the next keyframe."""
        return max(self.keyframes, default=-1) + 1

    def add_keyframe(self, keyframe: Keyframe) -> None:
        """Add a keyframe.

        Raises:
            ParameterError: the id is used.
        """
        if keyframe.id in self.keyframes:
            raise ParameterError("id", f"keyframe {keyframe.id} is in the graph twice")
        self.keyframes[keyframe.id] = keyframe
        self._edges_of[keyframe.id] = []
        if self._places is not None:
            row = [[keyframe.id, keyframe.pose.x, keyframe.pose.y]]
            self._places = np.concatenate([self._places, row])

    @property
    def places(self) -> FloatArray:
        """(n, 3) id, x and y of the keyframes, in the order of `keyframes`, map frame."""
        if self._places is None:
            rows = [(number, k.pose.x, k.pose.y) for number, k in self.keyframes.items()]
            self._places = np.array(rows, np.float64).reshape(-1, 3)
        return self._places

    def pose_at(self, stamp: float, odometry: Pose2D, session: int) -> Pose2D | None:
        """Return the pose at a stamp of a session by odometry from the keyframe nearest in time.

        None without a keyframe within LONGEST_LINK.
        """
        own = [keyframe for keyframe in self.keyframes.values() if keyframe.session == session]
        near = min(own, key=lambda keyframe: abs(keyframe.stamp - stamp), default=None)
        if near is None or abs(near.stamp - stamp) > LONGEST_LINK:
            return None
        return near.pose.compose(odometry.relative_to(near.odometry))

    def add_edge(self, edge: Edge) -> None:
        """Add an edge between two keyframes of the graph.

        Raises:
            ParameterError: a keyframe is missing, or both ends are the same.
        """
        for end in (edge.source, edge.target):
            if end not in self.keyframes:
                raise ParameterError("edge", f"there is no keyframe {end}")
        if edge.source == edge.target:
            raise ParameterError("edge", f"keyframe {edge.source} has an edge to itself")
        self.edges.append(edge)
        self._edges_of[edge.source].append(edge)
        self._edges_of[edge.target].append(edge)

    def replace_edges(self, edges: list[Edge]) -> None:
        """Replace all edges."""
        self.edges = []
        self._edges_of = {number: [] for number in self.keyframes}
        for edge in edges:
            self.add_edge(edge)

    def edges_of(self, keyframe: int) -> list[Edge]:
        """Edges that start or end at a keyframe, in the order of their creation."""
        return self._edges_of[keyframe]

    def add_sighting(self, key: LandmarkKey, size: float, keyframe: int, seen: Sighting) -> bool:
        """Add a marker seen at a keyframe, if it is better than one of the same keyframe.

        Raises:
            ParameterError: the keyframe is missing.
        """
        if keyframe not in self.keyframes:
            raise ParameterError("sighting", f"there is no keyframe {keyframe}")
        landmark = self.landmarks.setdefault(key, Landmark(size))
        known = landmark.sightings.get(keyframe)
        if known is not None and known.variance <= seen.variance:
            return False
        landmark.sightings[keyframe] = seen
        return True

    def set_poses(self, poses: Mapping[int, Pose2D]) -> None:
        """Move keyframes; those that are newer than all of `poses` move with the newest of them.

        Ids that are not in the graph are ignored.
        """
        known = [number for number in self.keyframes if number in poses]
        if not known:
            return
        self._places = None
        newest = known[-1]
        correction = poses[newest].compose(self.keyframes[newest].pose.inverse())
        for number, keyframe in self.keyframes.items():
            if number in poses:
                self.keyframes[number] = replace(keyframe, pose=poses[number])
            elif number > newest:
                self.keyframes[number] = replace(keyframe, pose=correction.compose(keyframe.pose))

    def set_scan(self, keyframe: int, scan: Scan) -> None:
        """Replace the scan of a keyframe, e.g. by one that has lost beams."""
        self.keyframes[keyframe] = replace(self.keyframes[keyframe], scan=scan)

    def remove_keyframe(self, keyframe: int) -> None:
        """Remove a keyframe; its neighbours stay connected.

        Each neighbour gets an edge to the neighbour with the strongest edge, composed of the two
        edges over the removed keyframe with their covariances (a spanning tree of the Markov
        blanket: H. Kretzschmar, C. Stachniss, "Information-theoretic compression of pose graphs",
        IJRR 2012). What was seen of markers moves to that neighbour.
        """
        outgoing = [_outgoing(edge, keyframe) for edge in self._edges_of[keyframe]]
        del self.keyframes[keyframe], self._edges_of[keyframe]
        self._places = None
        self.edges = [e for e in self.edges if keyframe not in (e.source, e.target)]
        for number in {edge.target for edge in outgoing}:
            kept = self._edges_of[number]
            self._edges_of[number] = [e for e in kept if keyframe not in (e.source, e.target)]
        best: dict[int, Edge] = {}
        for edge in outgoing:
            known = best.get(edge.target)
            if known is None or _strength(edge) > _strength(known):
                best[edge.target] = edge
        root = max(best.values(), key=_strength, default=None)
        self._move_sightings(keyframe, root)
        if root is None:
            return
        joined = {
            e.source + e.target - root.target
            for e in self._edges_of[root.target]
        }  # fmt: skip
        for number in sorted(best):
            if number != root.target and number not in joined:
                self.add_edge(_composed(root, best[number]))

    def _move_sightings(self, keyframe: int, edge: Edge | None) -> None:
        """Move the sightings of a removed keyframe along an edge from it; drop them without one."""
        for key, landmark in self.landmarks.items():
            seen = landmark.sightings.pop(keyframe, None)
            if seen is None or edge is None:
                continue
            back = reversed_edge(edge)
            moved = tuple(carried(one, back.relative, back.covariance) for one in seen.candidates)
            self.add_sighting(key, landmark.size, edge.target, Sighting(moved, seen.height))


def carried(seen: RelativePose, motion: Pose2D, covariance: FloatArray) -> RelativePose:
    """Return the pose of a marker relative to an earlier pose of the base.

    Args:
        seen: relative to the later pose of the base.
        motion: the later pose in the frame of the earlier one.
        covariance: (3, 3) of the motion, axes of the later pose.
    """
    pose = motion.compose(seen.pose)
    change, turn = lever(0.0, seen.pose), rotation(motion.heading)
    total = seen.covariance + change @ covariance @ change.T
    return RelativePose(pose, turn @ total @ turn.T, seen.share)


def reversed_edge(edge: Edge) -> Edge:
    """Return the same measurement from the target to the source."""
    relative = edge.relative.inverse()
    adjoint = _adjoint(relative)
    return Edge(
        edge.target, edge.source, relative, adjoint.T @ edge.information @ adjoint, edge.kind
    )


def _outgoing(edge: Edge, keyframe: int) -> Edge:
    return edge if edge.source == keyframe else reversed_edge(edge)


def _strength(edge: Edge) -> float:
    return float(np.linalg.det(edge.information))


def _composed(root: Edge, other: Edge) -> Edge:
    """Return the edge root.target -> other.target, from two edges of the same source."""
    back = reversed_edge(root)
    relative = back.relative.compose(other.relative)
    # Covariances are in the frame of each edge's target (right perturbations).
    transport = _adjoint(other.relative.inverse())
    covariance = transport @ back.covariance @ transport.T + other.covariance
    kinds = {root.kind, other.kind}
    kind: EdgeKind = "loop" if "loop" in kinds else "match" if "match" in kinds else "odometry"
    information: FloatArray = np.linalg.inv(covariance).astype(np.float64)
    return Edge(root.target, other.target, relative, information, kind)


def _adjoint(pose: Pose2D) -> FloatArray:
    """Return the (3, 3) adjoint of SE(2): moves a twist from the pose's frame to its parent's."""
    c, s = float(np.cos(pose.heading)), float(np.sin(pose.heading))
    return np.array([[c, -s, pose.y], [s, c, -pose.x], [0.0, 0.0, 1.0]])
