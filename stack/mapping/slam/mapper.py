"""Mapper: builds a pose graph of keyframes from scans and odometry.

Each scan is aligned to the surroundings of the last keyframe in the graph. After some motion it
becomes a keyframe, with edges to its neighbours. Earlier visits of a place are found by
`loops.LoopClosure`; after a loop closure the graph is optimised. Markers that pictures show are
landmarks of the graph, and a marker that is seen again closes a loop. With `is_mapping` off the
graph stays as it is, and scans are only matched with the nearest keyframes.
"""

from __future__ import annotations

import numpy as np

from stack.drivetrain.description import LidarDescription
from stack.localisation.planar import are_near
from stack.mapping.slam.graph import (
    Edge,
    EdgeKind,
    Keyframe,
    LandmarkKey,
    PoseGraph,
    Sighting,
    carried,
)
from stack.mapping.slam.landmarks import (
    LEAST_RETURN,
    Problem,
    place_landmarks,
    problem_of,
    returns_of,
    solve,
)
from stack.mapping.slam.loops import LoopClosure
from stack.mapping.slam.matching.alignment import LEAST_OVERLAP, align_step, softened
from stack.mapping.slam.matching.local_map import (
    EDGE_OVERLAP,
    LocalMap,
    ScanMatch,
    align_pair,
)
from stack.mapping.slam.matching.scans import PreparedScan, prepare
from stack.mapping.slam.neighbourhood import REFERENCE_DISTANCE, REFERENCE_KEYFRAMES, Neighbourhood
from stack.mapping.slam.odometry.chain import OdometryChain, lost_edge
from stack.mapping.slam.odometry.check import OdometryCheck
from stack.mapping.slam.odometry.error import is_jump, odometry_information
from stack.mapping.slam.optimiser import GraphOptimiser, Optimum
from stack.mapping.slam.parameters import MapperParameters
from stack.mapping.slam.rendering.renderer import MapRenderer
from stack.mapping.slam.upkeep import MapUpkeep
from stack.types import FloatArray, MarkerObservation, OccupancyGrid, Pose2D, Scan

KEYFRAME_DISTANCE, KEYFRAME_ANGLE = 0.25, 0.25
"""Metres driven or radians turned from keyframe to keyframe."""

NEIGHBOUR_EDGES = 6
"""Edges from a new keyframe to its neighbours, at most."""

PENDING, PENDING_SHARE = 60, 0.02
"""Edges to earlier visits, without a new loop, after which the graph is optimised: at least so
many, and so many for each keyframe."""


class Mapper:
    """SLAM: from scans with odometry to a pose graph, a trajectory and an occupancy grid.

    Args:
        parameters: of matching, loop closure and rendering.
        graph: to continue, as a new session; empty by default.
        noise: standard deviation of a range of the lidar, metres.
        keep_trajectory: keep the pose of every scan, for `trajectory`, and all keyframes; memory
            grows with time. Otherwise redundant and outdated keyframes are removed.
        immediate: optimise within `add`, for logs; otherwise the caller watches `needs_optimising`.

    Attributes:
        is_mapping: whether new keyframes are added; else the pose is found in the graph as it is.
        session: number of this mapping run in the graph.
    """

    def __init__(
        self,
        parameters: MapperParameters | None = None,
        graph: PoseGraph | None = None,
        *,
        noise: float = LidarDescription.noise,
        keep_trajectory: bool = False,
        immediate: bool = True,
    ) -> None:
        self.parameters = parameters or MapperParameters()
        self.graph = graph or PoseGraph()
        self.session = 1 + max((k.session for k in self.graph.keyframes.values()), default=-1)
        self.is_mapping = True
        self.neighbourhood = Neighbourhood(self.graph)
        self.needs_optimising = False
        self.loop_closures = 0
        self.match: ScanMatch | None = None
        self._immediate, self._noise = immediate, noise
        self._optimiser = GraphOptimiser()
        self._scans: dict[int, PreparedScan] = {}
        self._loops = LoopClosure(self.parameters, self.graph, self.neighbourhood, self.prepared)
        self._upkeep = MapUpkeep(self.graph, self.neighbourhood)
        self._renderer = MapRenderer(self.parameters)
        self._local: LocalMap | None = None
        self._last: Keyframe | None = None
        self._odometry, self._pose = Pose2D(0.0, 0.0), Pose2D(0.0, 0.0)
        # Stamps, keyframes and the poses relative to these: they follow the optimised graph.
        self._trajectory: list[tuple[float, int, Pose2D]] | None = [] if keep_trajectory else None
        self._pending, self._is_confirmed = 0, True
        self._matched_at, self._is_unsure, self._has_jumped = self._pose, False, False
        self._check, self._chain = OdometryCheck(), OdometryChain()
        if self.graph.keyframes:
            self._renderer.moved(self.graph)
            self._renderer.grid(self.graph)

    def configure(self, parameters: MapperParameters) -> None:
        """Apply new parameters to the next scans; the map keeps its resolution."""
        self.parameters = parameters
        self._loops.configure(parameters)

    def start(self, pose: Pose2D) -> None:
        """Set the pose of the first scan, map frame."""
        self._pose = pose

    def add(self, stamp: float, odometry_pose: Pose2D, scan: Scan) -> Pose2D:
        """Process a scan; return the pose of the base at its stamp, map frame.

        Args:
            stamp: of the scan, seconds.
            odometry_pose: of the base at the stamp, odom frame.
            scan: deskewed.
        """
        elapsed = self._check.elapsed(stamp)
        prepared = prepare(scan, self.parameters.match_range, self._noise)
        if self._last is None and not self.is_mapping and self.graph.keyframes:
            self._pose = self._pose.compose(odometry_pose.relative_to(self._odometry))
            self._odometry, self.match = odometry_pose, None
            self._follow()
        elif self._last is None:
            self._odometry = odometry_pose
            self._insert(stamp, odometry_pose, scan, prepared)
        else:
            self._pose = self._matched(stamp, elapsed, odometry_pose, prepared)
            self._odometry = odometry_pose
            if not self.is_mapping:
                if self._is_moved(self._matched_at):
                    self._follow()
            elif self._is_confirmed and self._is_lost(scan):
                self._check.note_loss(stamp)
                self._insert(stamp, odometry_pose, scan, prepared, is_lost=True)
            elif self._is_moved(self._matched_at) and self._may_insert():
                self._update(stamp, odometry_pose, scan, prepared)
        if self._trajectory is not None and self._last is not None:
            relative = self._pose.relative_to(self._last.pose)
            self._trajectory.append((stamp, self._last.id, relative))
        if self.needs_optimising and self._immediate:
            self.optimise()
        return self._pose

    def take_notes(self) -> list[str]:
        """Return what was found in scans and odometry since the last call, as sentences."""
        return self._check.take_notes()

    def add_marker(self, seen: MarkerObservation, odometry_pose: Pose2D) -> None:
        """Take a marker into the graph, as seen from the keyframe that scans are matched with.

        Args:
            seen: the marker in a picture taken at about the time of the last scan.
            odometry_pose: of the base at the picture, odom frame.
        """
        if not self.is_mapping or self._last is None or not self._is_confirmed:
            return
        motion = self._pose.relative_to(self._last.pose)
        motion = motion.compose(odometry_pose.relative_to(self._odometry))
        covariance = self._motion_covariance(motion)
        candidates = tuple(carried(one, motion, covariance) for one in seen.candidates)
        key: LandmarkKey = (seen.dictionary, seen.number)
        sighting = Sighting(candidates, seen.height)
        if not self.graph.add_sighting(key, seen.size, self._last.id, sighting):
            return
        self._pending += 1
        count = returns_of(self.graph.landmarks[key])
        if count and not count & (count - 1):  # again when twice as much is known
            self.loop_closures += count == LEAST_RETURN
            self.needs_optimising = True

    def _motion_covariance(self, motion: Pose2D) -> FloatArray:
        """Return the covariance (3, 3) of the motion since a keyframe, by odometry and scans."""
        information = odometry_information(motion)
        if self.match is not None:
            information = information + softened(self.match.information)
        covariance: FloatArray = np.linalg.inv(information).astype(np.float64)
        return covariance

    @property
    def pose(self) -> Pose2D:
        """Pose of the base at the newest scan, map frame."""
        return self._pose

    def set_pose(self, pose: Pose2D, odometry: Pose2D) -> None:
        """Continue at another pose, from the nearest keyframe or, far from all, a new one.

        Keyframes are added again once a scan matches there.
        """
        self._pose, self._odometry = pose, odometry
        self.match, self._is_confirmed = None, False
        self._chain.begin(None)
        self._follow()

    def set_mapping(self, is_mapping: bool) -> None:
        """Begin or cease to add keyframes."""
        if is_mapping and not self.is_mapping and self._last is not None:
            self.set_pose(self._pose, self._odometry)
        self.is_mapping, self._local = is_mapping, None

    def _follow(self) -> None:
        """Match the next scans with the keyframes nearest to the pose, if any is near."""
        pose, keyframes = self._pose, self.graph.keyframes.values()
        nearest = min(keyframes, key=lambda k: pose.distance_to(k.pose), default=None)
        reach = REFERENCE_DISTANCE
        is_near = nearest is not None and pose.distance_to(nearest.pose) <= reach
        self._last, self._local = nearest if is_near else None, None
        self._matched_at = pose

    def _may_insert(self) -> bool:
        """Return whether a scan has matched since the pose was set, or the robot is far away."""
        assert self._last is not None
        good = self.match is not None and self.match.overlap >= EDGE_OVERLAP
        far = self._pose.distance_to(self._last.pose) > REFERENCE_DISTANCE
        self._is_confirmed = self._is_confirmed or good or far
        return self._is_confirmed

    def problem(self) -> Problem:
        """Return what the optimiser needs; `needs_optimising` is False until the next change."""
        self.needs_optimising, self._pending = False, 0
        return problem_of(self.graph)

    def optimise(self) -> None:
        """Optimise the graph; poses, map and trajectory follow."""
        self.apply(solve(self.problem(), self._optimiser))

    def apply(self, optimum: Optimum) -> None:
        """Move keyframes to optimised poses; those added since move with the newest of them."""
        place_landmarks(self.graph, optimum.poses)
        self.graph.set_poses(optimum.poses)
        if self._last is not None:
            before, self._last = self._last, self.graph.keyframes[self._last.id]
            correction = self._last.pose.compose(before.pose.inverse())
            self._pose = correction.compose(self._pose)
            self._matched_at = correction.compose(self._matched_at)
        self._local = None
        self._renderer.moved(self.graph)

    def grid(self) -> OccupancyGrid:
        """Return the map drawn from all keyframes at their newest poses."""
        return self._renderer.grid(self.graph)

    def draw(self, keyframes: int) -> None:
        """Draw a piece of the map again after an optimisation."""
        self._renderer.step(self.graph, keyframes)

    @property
    def shown_grid(self) -> OccupancyGrid:
        """The map as far as it is drawn; a new object after each change.

        After an optimisation it is the last complete one until all keyframes are drawn again.
        """
        return self._renderer.shown

    def trajectory(self) -> list[tuple[float, Pose2D]]:
        """Return the pose of every scan by its stamp; empty without `keep_trajectory`."""
        keyframes = self.graph.keyframes
        return [
            (stamp, keyframes[number].pose.compose(relative))
            for stamp, number, relative in self._trajectory or ()
        ]

    def prepared(self, keyframe: int) -> PreparedScan:
        """Return the points and normals of a keyframe."""
        if keyframe not in self._scans:
            scan = self.graph.keyframes[keyframe].scan
            self._scans[keyframe] = prepare(scan, self.parameters.match_range, self._noise)
        return self._scans[keyframe]

    def _matched(
        self, stamp: float, elapsed: float, odometry: Pose2D, scan: PreparedScan
    ) -> Pose2D:
        """Return the pose of a scan; that of odometry if it does not match and is no jump."""
        moved = odometry.relative_to(self._odometry)
        pose, self.match = align_step(self._local_map(), scan, self._pose, moved, elapsed)
        self._is_unsure = self.match.overlap < LEAST_OVERLAP
        if self.match.information.any():
            matched = pose.relative_to(self._pose)
            doubt = self._check.compare(stamp, moved, matched, self.match.base_covariance)
            self._chain.doubt(doubt)
            self._is_unsure = self._is_unsure or bool(doubt.any())
        self._has_jumped = is_jump(moved, elapsed) and not self.match.information.any()
        return self._pose if self._has_jumped else pose

    def _is_lost(self, scan: Scan) -> bool:
        """Return whether neither odometry nor the scan tells the pose."""
        contradicts = self._upkeep.contradicts
        lost = self._is_unsure and contradicts(self._near(), self._pose, scan)
        return lost or self._has_jumped

    def _near(self) -> list[int]:
        """Return the keyframes that scans are matched with."""
        assert self._last is not None
        return self.neighbourhood.around(
            self._last.id, self._pose, REFERENCE_KEYFRAMES, REFERENCE_DISTANCE
        )

    def _local_map(self) -> LocalMap:
        if self._local is None:
            keyframes = [self.graph.keyframes[number] for number in self._near()]
            scans = [(keyframe.pose, self.prepared(keyframe.id)) for keyframe in keyframes]
            self._local = LocalMap(scans, self.parameters.resolution)
        return self._local

    def _is_moved(self, since: Pose2D) -> bool:
        return not are_near(self._pose, since, KEYFRAME_DISTANCE, KEYFRAME_ANGLE)

    def _update(self, stamp: float, odometry: Pose2D, scan: Scan, prepared: PreparedScan) -> None:
        """Add a keyframe if it shows something new; remove what is out of date or redundant."""
        if self._trajectory is not None:
            self._insert(stamp, odometry, scan, prepared)
            return
        assert self._last is not None
        found = self._upkeep.compare(self._last.id, self._pose, scan)
        for number in found.changed:
            self._scans.pop(number, None)
        if found.is_wanted:
            self._insert(stamp, odometry, scan, prepared)
        for number in found.surplus:
            self._remove(number)
        if found.changed or found.surplus:
            self._renderer.outdate(self.graph)
        if not found.is_wanted:
            self._chain.drive(self._pose.distance_to(self._matched_at))
            self._follow()

    def _remove(self, keyframe: int) -> None:
        """Remove a keyframe; its neighbours stay connected."""
        self.graph.remove_keyframe(keyframe)
        self._scans.pop(keyframe, None)
        self._loops.forget(keyframe)
        self._upkeep.forget(keyframe)

    def _insert(
        self, stamp: float, odometry: Pose2D, scan: Scan, prepared: PreparedScan, *,
        is_lost: bool = False,
    ) -> None:  # fmt: skip
        """Add a keyframe at the current pose, with its edges, and look for loops."""
        last = self._last
        new = Keyframe(self.graph.next_id, stamp, self._pose, odometry, scan, self.session)
        self.graph.add_keyframe(new)
        self._scans[new.id] = prepared
        if last is not None:
            self._chain.drive(self._pose.distance_to(self._matched_at))
            edge = lost_edge(last, new) if is_lost else self._chain.edge_to(new)
            if edge is not None:
                self.graph.add_edge(edge)
            if not is_lost:
                self._connect(last, new)
        self._last, self._local, self._matched_at = new, None, self._pose
        self._chain.begin(new)
        self._renderer.add(new)
        closed = self._loops.find(new.id)
        if closed:
            self.loop_closures += 1
            self.needs_optimising = True
        elif self._pending >= max(PENDING, PENDING_SHARE * new.id):
            self.needs_optimising = True

    def _connect(self, last: Keyframe, new: Keyframe) -> None:
        """Add the matches of a new keyframe with its neighbours."""
        near = self.neighbourhood.around(last.id, new.pose, NEIGHBOUR_EDGES, REFERENCE_DISTANCE)
        edges = 0
        for number in (n for n in dict.fromkeys((last.id, *near)) if n != new.id):
            revisit = new.id - number > 2 * REFERENCE_KEYFRAMES
            edge = self.matched_edge(number, new.id, "loop" if revisit else "match")
            if edge is not None:
                self.graph.add_edge(edge)
                edges += not revisit
                self._pending += revisit
        if not edges:  # nothing matches one scan alone: keep what the local map gave
            relative = new.pose.relative_to(last.pose)
            known = np.zeros((3, 3)) if self.match is None else self.match.information
            self.graph.add_edge(Edge(last.id, new.id, relative, softened(known), "match"))

    def matched_edge(self, source: int, target: int, kind: EdgeKind) -> Edge | None:
        """Return the edge between two keyframes by their scans; None if they overlap too little."""
        keyframes = self.graph.keyframes
        start = keyframes[target].pose.relative_to(keyframes[source].pose)
        found = align_pair(self.prepared(source), self.prepared(target), start)
        if found.overlap < EDGE_OVERLAP or not are_near(found.pose, start, 0.3, 0.15):
            return None
        return Edge(source, target, found.pose, softened(found.information), kind)
