"""The perception of a robot that the stack drives, also for displays."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TypeVar

from stack.components import Estimator
from stack.drivetrain.description import RobotDescription
from stack.errors import ParameterError
from stack.frames.buffer import TransformBuffer
from stack.frames.tree import inverse, lifted
from stack.navigation.tasks import Emit
from stack.parameters import suggestion
from stack.perception.blocks import BlockDetector
from stack.perception.calibration_watch import CalibrationWatch
from stack.perception.camera_lease import CameraLease
from stack.perception.closer_look import look_closer
from stack.perception.coloured_objects import ColouredObjectDetector
from stack.perception.depth.cloud import point_cloud
from stack.perception.floor_lines import FloorLineDetector
from stack.perception.markers.detector import MarkerDetector
from stack.perception.objects.detection import ObjectDetection
from stack.perception.places.memory import PlaceMemory
from stack.robot import Perception
from stack.types import (
    Block,
    ColourMask,
    CurrentStep,
    DepthImage,
    Detection,
    FloatArray,
    FloorLines,
    Image,
    LineColour,
    MarkerSighting,
    Measurement,
    ObjectColour,
    Perceived,
    PlaceSighting,
    PointCloud,
    Scan,
    StandingObject,
    TrackedObject,
)

SHOWN_FOR = 2.0
"""Seconds for which displays show what a search for a colour has found."""

SAME_TIME = 0.25
"""Seconds between two pictures in which nothing is taken to have moved."""

M = TypeVar("M", bound=Measurement)


@dataclass(frozen=True, kw_only=True)
class StackPerception(Perception):
    """Answers from the newest measurements, and searches pictures when it is asked.

    Attributes:
        robot: description of the robot.
        now: what the step has perceived.
        frames: poses by time stamp.
        estimator: of the pose.
        camera: keeps the camera on while pictures are requested.
        depth_camera: keeps the depth cameras on while point clouds are requested.
        objects: detections of a model.
        places: keyframes of the map.
        detector: of markers; None when the robot has no camera.
        lines: on the floor.
        coloured: objects of a colour.
        block_detector: of blocks for an arm.
        calibration: compares where blocks were shown with where they are.
        emit: called with (kind, text, level="info", **fields) for each event.
    """

    robot: RobotDescription
    now: CurrentStep
    frames: TransformBuffer
    estimator: Estimator
    camera: CameraLease
    depth_camera: CameraLease
    objects: ObjectDetection
    places: PlaceMemory
    detector: MarkerDetector | None
    lines: FloorLineDetector
    coloured: ColouredObjectDetector
    block_detector: BlockDetector
    calibration: CalibrationWatch
    emit: Emit

    @property
    def _perceived(self) -> Perceived:
        return self.now.perceived

    @property
    def scan(self) -> Scan | None:
        return self._perceived.newest(self.estimator.lidar, Scan)

    @property
    def tracks(self) -> tuple[TrackedObject, ...]:
        return self._perceived.at(self.estimator.estimate).world.tracks

    @property
    def standing_objects(self) -> tuple[StandingObject, ...]:
        return self._perceived.at(self.estimator.estimate).world.standing

    def image(self) -> Image | None:
        """The newest camera image since the camera was switched on; keeps it on.

        Images from before the camera was last off are not returned: they are out of date.
        """
        self.camera.renew(self._perceived.time)
        image = self._perceived.newest("camera", Image)
        return image if image is not None and self.camera.covers(image.stamp) else None

    def point_cloud(
        self, camera: str = "", *, voxel: float = 0.05, above: float | None = None
    ) -> PointCloud | None:
        name = self._depth_camera(camera)
        if not voxel > 0.0:
            raise ParameterError("voxel", f"expected more than 0 m, got {voxel:g}", "e.g. 0.05")
        image = self._depth_image(name)
        return None if image is None else point_cloud(image, voxel=voxel, above=above)

    def _depth_camera(self, camera: str) -> str:
        """Return the name of a depth camera, or of the first one without a name."""
        known = self.robot.depth_cameras
        name = camera or next(iter(known), "")
        if name in known:
            return name
        if not known:
            raise ParameterError("camera", "the robot has no depth camera")
        raise ParameterError("camera", f"unknown depth camera {name!r}", suggestion(name, known))

    def _depth_image(self, name: str) -> DepthImage | None:
        """Return the newest picture of a depth camera since it was switched on; keeps it on."""
        lease = self.depth_camera
        lease.renew(self._perceived.time)
        image = self._perceived.newest(name, DepthImage)
        return image if image is not None and lease.covers(image.stamp) else None

    def newest(self, name: str, kind: type[M]) -> M | None:
        return self._perceived.newest(name, kind)

    def marker_sightings(self) -> tuple[MarkerSighting, ...]:
        image = self.image()
        if image is None or self.detector is None:
            return ()
        return self.detector.sightings(image)

    @property
    def keyframes(self) -> int:
        return self.places.count

    def place_sightings(self) -> tuple[PlaceSighting, ...]:
        image = self.image()
        return () if image is None else self.places.sightings(image, self.frames)

    def floor_lines(self, colour: LineColour, width: float) -> FloorLines | None:
        image = self.image()
        if image is None or not self.frames.covers(image.stamp):
            return None
        base = self.frames.pose_at("odom", image.stamp)
        obstacles = self._perceived.motion.pose.transform(self._perceived.obstacles.points)
        return self.lines.see(image, base, colour, width, obstacles)

    def coloured_objects(self, colour: ObjectColour) -> tuple[Detection, ...] | None:
        image, frames = self.image(), self.frames
        if image is None or not frames.covers(image.stamp):
            return None
        ranges = self._perceived.motion.pose.transform(self._perceived.obstacles.points)
        ranges = frames.pose_at("odom", image.stamp).inverse().transform(ranges)
        return self.coloured.detect(image, colour, frames.pose_at("map", image.stamp), ranges)

    def blocks(self, camera: str = "") -> tuple[Block, ...] | None:
        name = self._depth_camera(camera)
        if self.robot.camera is None:
            raise ParameterError("", "the robot has no colour camera, which tells blocks apart")
        image, depth = self.image(), self._depth_image(name)
        if image is None or depth is None or abs(image.stamp - depth.stamp) > SAME_TIME:
            return None
        now = self._link_now(depth.stamp)
        return None if now is None else tuple(
            replace(block, pose=now @ block.pose, camera=name)
            for block in self.block_detector.detect(image, depth)
        )  # fmt: skip

    def _link_now(self, stamp: float) -> FloatArray | None:
        """(4, 4) base link of the arm now <- at a stamp; None if it is not known where it was."""
        if not self.frames.covers(stamp):
            return None
        then, link = self.frames.pose_at("odom", stamp), self.block_detector.base_from_link
        return inverse(link) @ lifted(then.relative_to(self._perceived.motion.pose)) @ link

    @property
    def hand_camera(self) -> str:
        cameras = self.robot.depth_cameras.items()
        return next((name for name, camera in cameras if camera.link), "")

    def look_closer(self, block: Block, since: float) -> Block | None:
        depth = self._depth_image(self.hand_camera) if self.hand_camera else None
        if depth is None or depth.stamp < since:
            return None
        now = self._link_now(depth.stamp)
        if now is None:
            return None
        then = replace(block, pose=inverse(now) @ block.pose)
        found = look_closer(then, depth, self.block_detector.base_from_link)
        if found is None:
            return None
        if block.camera not in ("", self.hand_camera):
            self._note_miss(then, found)
        return replace(found, pose=now @ found.pose, camera=self.hand_camera)

    def _note_miss(self, block: Block, found: Block) -> None:
        """Report a systematic error of the camera once it is certain."""
        watch = self.calibration
        was_known = watch.offset is not None
        watch.add(block.pose[:3, 3], found.pose[:3, 3])
        offset = watch.offset
        if offset is not None and not was_known:
            x, y, z = (round(float(value), 4) for value in offset.offset)
            self.emit(
                "calibration", str(offset), level="warning", offset=[x, y, z], count=offset.count
            )

    def is_gone(self, block: Block, camera: str = "") -> bool:
        depth = self._depth_image(self._depth_camera(camera))
        now = None if depth is None else self._link_now(depth.stamp)
        if depth is None or now is None:
            return False
        return self.block_detector.is_gone(replace(block, pose=inverse(now) @ block.pose), depth)

    def detections(self, label: str | None = None) -> tuple[Detection, ...] | None:
        found = self.objects.detections(self._perceived.time)
        if found is None or label is None:
            return found
        return tuple(item for item in found if item.label == label)

    @property
    def seen_objects(self) -> tuple[Detection, ...]:
        """What detector and search for a colour found in recent pictures, for displays."""
        now = self._perceived.time
        return (*(self.objects.recent(now) or ()), *self.coloured.recent(now - SHOWN_FOR))

    @property
    def colour_mask(self) -> ColourMask | None:
        """Pixels of the colour that was searched in a recent picture, for displays."""
        mask = self.coloured.mask
        return mask if mask is not None and mask.stamp >= self._perceived.time - SHOWN_FOR else None
