"""Components of a robot facade."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

from stack.components import Estimator
from stack.drivetrain.description import RobotDescription
from stack.frames.buffer import TransformBuffer
from stack.navigation.facade.interfaces import (
    ColouredObjectDetector,
    FloorLineDetector,
    ImageStore,
    MarkerDetector,
    ObjectDetection,
)
from stack.navigation.map_service import MapService
from stack.navigation.navigator import Navigator
from stack.navigation.tasks import CostmapLike, Emit
from stack.navigation.tuning import Tunable
from stack.perception.camera_lease import CameraLease
from stack.perception.places.memory import PlaceMemory
from stack.types import Marker, OccupancyGrid, Pose2D


@dataclass(frozen=True)
class FacadeParts:
    """Components of a robot facade.

    Attributes:
        robot: description of the robot.
        clock: returns the seconds on the body's clock.
        frames: poses by time stamp.
        camera: keeps the camera on while pictures are requested.
        markers: the known markers of the world, map frame.
        detector: of markers; None when the robot has no camera.
        tunables: components whose parameters may be changed, by name.
        cover: without a map, grows the costmaps to contain some poses.
        draw: replaces the map of the costmaps.
        maps: the map so far.
        recording_over: whether all measurements of a replayed log have been played.
        floor_lines: None when the robot has no camera.
        coloured_objects: likewise.
        objects: detections of a model; None without one.
        depth_camera: keeps the depth cameras on while point clouds are requested.
        places: keyframes of the map; None when they are not used.
    """

    robot: RobotDescription
    clock: Callable[[], float]
    frames: TransformBuffer
    camera: CameraLease
    navigator: Navigator
    estimator: Estimator
    local_costmap: CostmapLike
    global_costmap: CostmapLike
    store: ImageStore
    emit: Emit
    maps: MapService
    markers: tuple[Marker, ...] = ()
    detector: MarkerDetector | None = None
    tunables: Mapping[str, Tunable] = field(default_factory=dict)
    cover: Callable[[Iterable[Pose2D]], None] = lambda poses: None
    draw: Callable[[OccupancyGrid], None] = lambda grid: None
    recording_over: Callable[[], bool] = lambda: False
    floor_lines: FloorLineDetector | None = None
    coloured_objects: ColouredObjectDetector | None = None
    objects: ObjectDetection | None = None
    depth_camera: CameraLease = field(default_factory=CameraLease)
    places: PlaceMemory | None = None
