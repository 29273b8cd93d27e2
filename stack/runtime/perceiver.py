"""Perceiver: turns the measurements of a step into what is perceived of robot and surroundings."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass

from stack.components import Estimator, OdometryFusion
from stack.frames.buffer import TransformBuffer
from stack.navigation.relocalisation import report_pose
from stack.navigation.tasks import Emit
from stack.navigation.world_model import WorldStage
from stack.perception.camera_lease import CameraLease
from stack.perception.cameras.watch import CameraWatch
from stack.perception.depth.obstacles import DepthObstacles
from stack.perception.depth.scan import DepthScans
from stack.perception.markers.stage import MarkerStage
from stack.perception.objects.detection import ObjectDetection
from stack.perception.obstacle_memory import ObstacleMemory
from stack.perception.places.memory import PlaceMemory
from stack.perception.smoothing import smooth_observation
from stack.telemetry.records import Layer
from stack.types import Observation, Odometry, Perceived, PoseEstimate, has_jumped


@dataclass(kw_only=True)
class Perceiver:
    """The parts that perceive, in the order in which a step uses them.

    Attributes:
        camera: keeps the colour camera on while pictures are requested.
        depth_camera: keeps the depth cameras on while point clouds are requested.
        map_layer: the map to show: the mission's, or the one that the estimator draws.
        is_mapped: whether the mission has a map.
        emit: called with (kind, text, level="info", **fields) for each event.
    """

    odometry: OdometryFusion
    frames: TransformBuffer
    estimator: Estimator
    cameras: CameraWatch
    depth_scans: DepthScans
    markers: MarkerStage
    places: PlaceMemory
    depth: DepthObstacles
    obstacle_memory: ObstacleMemory
    objects: ObjectDetection
    world_model: WorldStage
    camera: CameraLease
    depth_camera: CameraLease
    map_layer: Layer
    is_mapped: bool
    emit: Emit

    def captures(self, now: float) -> bool:
        """Whether the colour camera shall take pictures at a time in seconds."""
        asked = self.camera.is_active(now) or self.markers.wants_picture(now)
        return asked or self.places.wants_picture

    def measures_depth(self, now: float) -> bool:
        """Whether the depth cameras shall take pictures at a time in seconds."""
        return self.depth.is_on or self.depth_scans.is_on or self.depth_camera.is_active(now)

    def await_input(self, now: float, longest: float) -> bool:
        """Wait at most `longest` wall seconds for what the step at a time needs.

        Returns:
            Whether it is there: an optimised map and detections that are due.
        """
        waited = self.estimator.await_input(now, longest)
        return waited and self.objects.await_result(now, longest)

    def move(self, observation: Observation) -> Odometry:
        """Return the fused odometry with the new measurements."""
        motion = self.odometry.update(observation)
        self.frames.add(motion)
        return motion

    def estimate(self, observation: Observation) -> PoseEstimate:
        """Return the pose with new deskewed scans and pictures."""
        before = self.estimator.estimate
        estimate = self.estimator.update(observation, self.frames)
        self._report_jump(before, estimate, "lidar")
        for note in self.estimator.take_notes():
            self.emit("estimator", note, level="warning")
        fix = self.markers.update(observation, self.frames)
        if fix is not None:
            before, estimate = estimate, self.estimator.update_markers(fix, self.frames)
            self._report_jump(before, estimate, "marker")
        self.frames.correct(estimate)
        self.markers.add_views(observation, self.frames, estimate)
        if self.estimator.maps_markers:
            self.estimator.observe_markers(self.markers.observed(observation), self.frames)
        return estimate

    def _report_jump(self, before: PoseEstimate, after: PoseEstimate, source: str) -> None:
        if has_jumped(before, after):
            report_pose(self.emit, before.pose, after.pose, source)

    def perceive(  # noqa: PLR0913 - what a step knows
        self, observation: Observation, motion: Odometry, estimate: PoseEstimate, last: Perceived,
        measure: Callable[[str], AbstractContextManager[None]], *, evades: bool,
    ) -> Perceived:  # fmt: skip
        """Return the record of this step.

        Args:
            observation: with deskewed scans.
            motion: of this step.
            estimate: of this step.
            last: record of the step before.
            measure: context that times a stage.
            evades: whether only evasion keeps the robot clear of who walks.
        """
        tracks = self.at(last, estimate).world.tracks
        with measure("places"):
            self.places.update(observation, self.frames, estimate, motion.twist.angular)
        with measure("obstacles"):
            smooth = smooth_observation(observation)
            depth = self.depth.update(smooth, self.frames)
            obstacles = self.obstacle_memory.update(smooth, self.frames, depth, tracks)
        with measure("objects"):
            objects = self.objects.update(smooth, self.frames, obstacles, tracks)
        with measure("costmap"):
            self._show_map()
            world = self.world_model.update(
                smooth, self.frames, depth, objects, motion.twist, evades=evades
            )
        measurements = {**last.measurements, **observation.measurements}
        return Perceived(
            observation.time, estimate, motion, obstacles, depth, objects, world, measurements
        )

    def at(self, perceived: Perceived, estimate: PoseEstimate) -> Perceived:
        """Return a record at an estimate; after a jump, also costmaps and tracker forget."""
        if perceived.is_outdated_by(estimate):
            self.world_model.forget()
            self.objects.forget()
        return perceived.at(estimate)

    def close(self) -> None:
        """Stop the workers of estimator and detector, also if one of them raises."""
        try:
            self.objects.close()
        finally:
            self.estimator.close()

    def _show_map(self) -> None:
        """Show the map that the estimator draws in the costmaps and to viewers."""
        drawn = self.estimator.take_map()
        if drawn is not None:
            self.world_model.show(drawn)
            self.map_layer = Layer(self.map_layer.version + 1, drawn)
