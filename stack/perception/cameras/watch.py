"""Watch on cameras: which pictures can be used, and whether a camera works.

Everything behind it receives usable pictures only. A depth camera without them grows old, and the
safety stage first limits the speed and then stops the robot; a colour camera without them is a
camera that delivers nothing, and the behaviours that need it fail in their own words.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field
from math import inf
from zlib import crc32

import numpy as np

from stack.drivetrain.description import RobotDescription
from stack.perception.cameras.faults import Fault, fault_of
from stack.perception.cameras.parameters import CameraParameters
from stack.perception.sensor_watch import SensorEvent
from stack.types import (
    CameraModel,
    CameraState,
    DepthImage,
    Image,
    Observation,
    Pose2D,
    wrap_angle,
)

FROZEN_MOTION = 0.05
"""Motion in which a camera that works shows something else: metres driven plus radians turned. A
robot that stands may see the same again and again."""
LEAST_VALID = 0.05
"""Share of the pixels of a depth picture with a distance within range."""
RECOVERED_AFTER = 3
"""Good pictures in a row after which the camera works again."""

COLOUR_CAMERA = "camera"
"""Name of the colour camera."""

ROUNDING = 1e-6
"""Seconds by which a stamp may lie in the future."""


@dataclass(slots=True)
class _Watched:
    """What is known of one camera."""

    model: CameraModel
    fault: Fault | None = None
    good: int = 0
    on_since: float | None = None
    newest: float = -inf  # stamp of the newest usable picture
    arrived: float = -inf  # stamp of the newest picture of any kind
    digest: int = 0
    repeats: int = 0
    same_since: Pose2D = field(default_factory=lambda: Pose2D(0.0, 0.0))


class CameraWatch:
    """Judges the pictures of a robot's cameras."""

    def __init__(self, robot: RobotDescription, parameters: CameraParameters) -> None:
        self.parameters = parameters
        colour = {} if robot.camera is None else {COLOUR_CAMERA: robot.camera.model}
        depth = {name: camera.model for name, camera in robot.depth_cameras.items()}
        self._cameras = {name: _Watched(model) for name, model in {**colour, **depth}.items()}
        self._looked_at: float | None = None
        self._events: list[SensorEvent] = []

    @property
    def states(self) -> tuple[CameraState, ...]:
        """State of every camera."""
        now = self._looked_at
        if now is None:
            return tuple(map(CameraState, self._cameras))
        return tuple(
            CameraState(
                name, camera.on_since is not None, now - camera.newest,
                camera.fault.word if camera.fault is not None else "",
            )
            for name, camera in self._cameras.items()
        )  # fmt: skip

    def configure(self, parameters: CameraParameters) -> None:
        """Apply new parameters, from the next picture on."""
        self.parameters = parameters

    def update(
        self, observation: Observation, odometry: Pose2D, requested: Collection[str]
    ) -> tuple[Observation, list[SensorEvent]]:
        """Return the observation without the pictures that cannot be used, and what has changed.

        Args:
            observation: the new measurements.
            odometry: pose in the odom frame, to tell a frozen camera from a robot that stands.
            requested: names of the cameras that shall take pictures.
        """
        now, refused, self._events = observation.time, [], []
        for name, camera in self._cameras.items():
            picture = observation.measurements.get(name)
            if isinstance(picture, Image | DepthImage):
                fault = self._judged(camera, picture, now, odometry)
                self._note(name, camera, fault)
                if fault is None or fault.is_usable:
                    camera.newest = picture.stamp
                else:
                    refused.append(name)
            self._note_silence(name, camera, now, is_on=name in requested)
        self._looked_at = now
        if refused:
            kept = {k: v for k, v in observation.measurements.items() if k not in refused}
            observation = Observation(now, kept)
        return observation, self._events

    def _judged(
        self, camera: _Watched, picture: Image | DepthImage, now: float, odometry: Pose2D
    ) -> Fault | None:
        """Return what is wrong with a picture."""
        p, stamp = self.parameters, picture.stamp
        if not -inf < stamp <= now + ROUNDING:
            return Fault("stamp", f"delivers a picture stamped {stamp:.3f} s at {now:.3f} s")
        if stamp <= camera.arrived:
            text = f"delivers a picture stamped {stamp:.3f} s after one of {camera.arrived:.3f} s"
            return Fault("stamp", text)
        camera.arrived = stamp
        fault = fault_of(picture, camera.model, LEAST_VALID)
        if fault is not None and not fault.is_usable:
            return fault
        if self._is_frozen(camera, picture, odometry):
            return Fault("frozen", f"delivered the same picture {camera.repeats + 1} times")
        if now - stamp > p.late_after:
            text = f"delivers pictures that are {now - stamp:.2f} s old; expected {p.late_after:g}"
            return Fault("late", f"{text} s at most", is_usable=True)
        return fault

    def _is_frozen(self, camera: _Watched, picture: Image | DepthImage, odometry: Pose2D) -> bool:
        """Return whether the same picture came too often while the robot moved.

        A frozen camera remains so until another picture comes, also while the robot stands.
        """
        pixels = picture.depth if isinstance(picture, DepthImage) else picture.pixels
        digest = crc32(np.ascontiguousarray(pixels).data)
        if digest != camera.digest or camera.arrived == -inf:
            camera.digest, camera.repeats, camera.same_since = digest, 0, odometry
            return False
        camera.repeats += 1
        if camera.fault is not None and camera.fault.word == "frozen":
            return True
        turned = abs(wrap_angle(odometry.heading - camera.same_since.heading))
        moved = camera.same_since.distance_to(odometry) + turned
        most = self.parameters.frozen_pictures
        return 0 < most <= camera.repeats and moved >= FROZEN_MOTION

    def _note(self, name: str, camera: _Watched, fault: Fault | None) -> None:
        """Note a picture's fault, or a good picture; report the first one and the recovery."""
        if fault is None:
            camera.good += 1
            if camera.fault is not None and camera.good >= RECOVERED_AFTER:
                camera.fault = None
                self._events.append(SensorEvent(name, "", f"the camera {name} works again"))
            return
        camera.good = 0
        if camera.fault is None or camera.fault.word != fault.word:
            ignored = "" if fault.is_usable or fault.word == "silent" else "; it is ignored"
            text = f"the camera {name} {fault.text}{ignored}"
            self._events.append(SensorEvent(name, fault.word, text))
        camera.fault = fault

    def _note_silence(self, name: str, camera: _Watched, now: float, *, is_on: bool) -> None:
        """Note that no picture comes from a camera that is on."""
        if not is_on:
            camera.on_since = None
            return
        if camera.on_since is None:
            camera.on_since = now
        silence = now - max(camera.on_since, camera.arrived)
        longest = self.parameters.silent_after
        if silence > longest + ROUNDING and (camera.fault is None or camera.fault.word != "silent"):
            text = f"has delivered no picture for {silence:.2f} s; expected {longest:g} s at most"
            self._note(name, camera, Fault("silent", text))
