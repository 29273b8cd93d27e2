"""Logs the states of a run to Foxglove's topics: what changed, and only where somebody reads."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import foxglove
import numpy as np
from foxglove import messages as schemas

from stack.schedule import Schedule
from stack.telemetry.foxglove import values
from stack.telemetry.foxglove.messages import (
    calibration,
    camera_frame,
    cloud,
    depth_picture,
    fixed_frames,
    grid_message,
    log_line,
    moving_frames,
    nanoseconds,
    picture,
    pose_in,
    poses,
    scan_message,
)
from stack.telemetry.foxglove.scene import moving, places, robot_model, surroundings
from stack.telemetry.foxglove.urdf_links import BASE, MAP, ODOM, links_of
from stack.telemetry.records import ROUTINE, Event, Layer, RunInfo, Snapshot
from stack.types import CameraModel, CostGrid, DepthImage, Image, OccupancyGrid, Scan

_NOTHING = object()


class Topics:
    """Topics by name; a message is made only if somebody reads it.

    Args:
        context: of the file or server that the topics belong to.
    """

    def __init__(self, context: Any) -> None:
        self._context = context
        self._channels: dict[str, Any] = {}
        self._last: dict[str, object] = {}

    def log(self, topic: str, schema: Any, time: float, make: Callable[[], Any]) -> None:
        """Log one of Foxglove's messages at a robot time, seconds."""
        if topic not in self._channels:
            self._channels[topic] = foxglove.Channel(
                topic,
                schema=schema.get_schema(),
                message_encoding="protobuf",
                context=self._context,
            )
        channel = self._channels[topic]
        if channel.has_sinks():
            channel.log(make().encode(), log_time=nanoseconds(time))

    def log_json(self, topic: str, time: float, make: Callable[[], Any]) -> None:
        """Log a JSON object at a robot time, seconds."""
        if topic not in self._channels:
            schema = foxglove.Schema(
                name=f"treepilot{topic.replace('/', '.')}",
                encoding="jsonschema",
                data=json.dumps(values.SCHEMAS.get(topic, values.OPEN)).encode(),
            )
            self._channels[topic] = foxglove.Channel(
                topic, schema=schema, message_encoding="json", context=self._context
            )
        channel = self._channels[topic]
        if channel.has_sinks():
            channel.log(values.finite(make()), log_time=nanoseconds(time))

    def is_new(self, topic: str, value: object) -> bool:
        """Whether the value is another one than at the last call for this topic."""
        before, self._last[topic] = self._last.get(topic, _NOTHING), value
        if before is value:
            return False
        return isinstance(value, np.ndarray) or before != value  # arrays are replaced as a whole

    def forget(self) -> None:
        """Count every value as new again: a reader has come who has seen nothing."""
        self._last.clear()


class FoxgloveDrawing:
    """Logs events, snapshots and measurements of a run.

    Args:
        info: of the run.
        context: of the file or server.
        periods: least robot time between two versions of a layer, seconds, by its name.
    """

    def __init__(
        self, info: RunInfo, context: Any, periods: Mapping[str, float] | None = None
    ) -> None:
        self._info, self._topics = info, Topics(context)
        self._links = links_of(info.urdf)
        self._frames = self._links.frames
        self._cameras: dict[str, CameraModel] = {}
        self._periods = periods or {}
        self._clocks: dict[str, Schedule] = {}
        self.forget()

    def forget(self) -> None:
        """Log with the next snapshot also what did not change."""
        self._topics.forget()
        self._clocks = {name: Schedule(period) for name, period in self._periods.items()}

    def event(self, event: Event) -> None:
        """Log an event; its sentence only if it is for people."""
        self.value("/events", event.time, event)
        if event.kind not in ROUTINE:
            self._topics.log("/log", schemas.Log, event.time, partial(log_line, event))

    def draw(self, snapshot: Snapshot) -> None:
        """Log a snapshot."""
        self._draw_poses(snapshot)
        self._draw_plans(snapshot)
        for name, layer in snapshot.layers.items():
            self._draw_layer(name, layer, snapshot)
        self._draw_scene(snapshot)
        self._draw_points(snapshot)
        self._draw_values(snapshot)
        if snapshot.scan is not None:
            self.scan("/scan", snapshot.scan)
        if snapshot.image is not None:
            self.image("camera", snapshot.image)
        if snapshot.depth_image is not None:
            self.image("depth", snapshot.depth_image)

    def scan(self, topic: str, scan: Scan) -> None:
        """Log a scan unless it is the last one."""
        if self._topics.is_new(topic, scan.stamp):
            self._topics.log(topic, schemas.LaserScan, scan.stamp, partial(scan_message, scan))

    def image(self, name: str, image: Image | DepthImage) -> None:
        """Log a picture unless it is the last one, and its camera when it is new."""
        topics, time, camera = self._topics, image.stamp, image.camera
        at, about = f"/{name}/image", f"/{name}/calibration"
        if not topics.is_new(at, time):
            return
        if self._cameras.get(name) != camera:
            self._cameras[name] = camera
            self._frames = (*self._frames, camera_frame(name, camera))
        self._draw_fixed_frames(time)
        if topics.is_new(about, camera):
            made = partial(calibration, name, camera, time)
            topics.log(about, schemas.CameraCalibration, time, made)
        if isinstance(image, DepthImage):
            topics.log(at, schemas.RawImage, time, partial(depth_picture, name, image))
        else:
            topics.log(at, schemas.CompressedImage, time, partial(picture, name, image))

    def value(self, topic: str, time: float, record: object) -> None:
        """Log a record as a JSON object."""
        self._topics.log_json(topic, time, partial(values.finite, record))

    def _draw_fixed_frames(self, time: float) -> None:
        if self._frames and self._topics.is_new("/tf_static", self._frames):
            made = partial(fixed_frames, time, self._frames)
            self._topics.log("/tf_static", schemas.FrameTransforms, time, made)

    def _draw_poses(self, snapshot: Snapshot) -> None:
        """Log the frames, and the poses of the base in them."""
        topics, time, pose = self._topics, snapshot.time, snapshot.pose
        odometry, truth = snapshot.odometry, snapshot.truth
        above = (MAP, ODOM, pose.compose(odometry.inverse())), (ODOM, BASE, odometry)
        self._draw_fixed_frames(time)
        topics.log("/tf", schemas.FrameTransforms, time, partial(moving_frames, time, above))
        found = {"/pose": (MAP, pose), "/odometry": (ODOM, odometry)}
        if truth is not None:
            found["/truth"] = MAP, truth
        for topic, (frame, place) in found.items():
            topics.log(topic, schemas.PoseInFrame, time, partial(pose_in, frame, place, time))

    def _draw_plans(self, snapshot: Snapshot) -> None:
        topics, time = self._topics, snapshot.time
        for topic, path in (("/path", snapshot.path), ("/local_plan", snapshot.local_plan)):
            if topics.is_new(topic, path):
                points = None if path is None else path.points
                topics.log(topic, schemas.PosesInFrame, time, partial(poses, points, time))

    def _draw_layer(self, name: str, layer: Layer, snapshot: Snapshot) -> None:
        topics, time, content = self._topics, snapshot.time, layer.content
        clock = self._clocks.get(name)
        is_due = clock is None or clock.take(time) or snapshot.state.is_over
        if not is_due or not topics.is_new(f"/{name}", layer.version):
            return
        if isinstance(content, tuple):
            made = partial(surroundings, content, time)
            topics.log(f"/{name}", schemas.SceneUpdate, time, made)
        elif isinstance(content, OccupancyGrid | CostGrid):
            topics.log(f"/{name}", schemas.Grid, time, partial(grid_message, name, content, time))

    def _draw_scene(self, snapshot: Snapshot) -> None:
        topics, time, info = self._topics, snapshot.time, self._info
        made = partial(moving, snapshot, info.footprint)
        topics.log("/moving", schemas.SceneUpdate, time, made)
        if topics.is_new("/places", info.identity):
            topics.log("/places", schemas.SceneUpdate, time, partial(places, info, time))
        if topics.is_new("/robot", info.identity):
            made = partial(robot_model, self._links.shapes, info.footprint, time)
            topics.log("/robot", schemas.SceneUpdate, time, made)

    def _draw_points(self, snapshot: Snapshot) -> None:
        """Log the particles of the localisation and the obstacles of depth cameras."""
        topics, time = self._topics, snapshot.time
        particles, depth = snapshot.particles, snapshot.depth_points
        if particles is not None and topics.is_new("/particles", particles):
            topics.log("/particles", schemas.PosesInFrame, time, partial(poses, particles, time))
        if depth is not None and topics.is_new("/depth_points", depth):
            topics.log("/depth_points", schemas.PointCloud, time, partial(cloud, depth, time))

    def _draw_values(self, snapshot: Snapshot) -> None:
        for topic, make in values.EACH_TIME.items():
            self._topics.log_json(topic, snapshot.time, partial(make, snapshot))
        for topic, (value, make) in values.changing(snapshot).items():
            if self._topics.is_new(topic, value):
                self._topics.log_json(topic, snapshot.time, partial(make, value))
