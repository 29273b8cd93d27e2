"""Memory of places: keyframes recorded while the robot drives or loaded with a map."""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from pathlib import Path

import numpy as np

from stack.errors import FrameError
from stack.frames.buffer import TransformBuffer
from stack.parameters import refuse_changes
from stack.perception.places.descriptor import GlobalDescriptor
from stack.perception.places.keyframe_files import (
    FILE,
    check_model,
    keyframe_file,
    read_keyframes,
)
from stack.perception.places.keyframes import Keyframe, keyframe_of
from stack.perception.places.parameters import PlaceParameters
from stack.perception.places.recogniser import FEATURES, LEAST_KEYFRAMES, PlaceRecogniser
from stack.types import (
    FloatArray,
    Image,
    Observation,
    PlaceSighting,
    Pose2D,
    PoseEstimate,
    Scan,
    has_jumped,
    wrap_angle,
)

FASTEST_TURN = 0.8
"""No keyframe is taken while the robot turns faster, rad/s: pictures are blurred."""
MOST_KEYFRAMES = 1000
"""Keyframes after which no more are recorded: 1000 are about 100 MB."""

SCANS = 12
"""Scans that are kept for pictures, which arrive later."""

LARGEST_AGE = 0.25
"""Seconds between a picture and the scan that places its features."""

FIXED = ("descriptor", "descriptor_size", "descriptor_normalised")
"""Parameters that hold for a run."""


class PlaceMemory:
    """Records keyframes, and recognises where a picture was taken.

    A keyframe is kept once the localisation has stayed good for `settling_time`: a robot that was
    just lifted elsewhere does not know yet that its pose is wrong. With an estimator that draws the
    map, a later loop closure does not move the keyframes.
    """

    def __init__(
        self, lidar: str, *, has_camera: bool, parameters: PlaceParameters,
        descriptor: GlobalDescriptor | None = None,
    ) -> None:  # fmt: skip
        """Create an empty memory.

        Args:
            lidar: name of the lidar whose scans place the features; empty without one.
            has_camera: whether the robot has one.
            parameters: what is recorded and accepted.
            descriptor: describes whole pictures; None: VLAD does.
        """
        self.parameters, self._descriptor = parameters, descriptor
        self._model = descriptor.digest if descriptor is not None else ""
        self._lidar, self._sees = lidar, has_camera and bool(lidar)
        self._scans: deque[Scan] = deque(maxlen=SCANS)
        self._kept: list[Keyframe] = []
        self._pending: list[Keyframe] = []
        self._looked: list[tuple[float, Pose2D]] = []
        self._recogniser: PlaceRecogniser | None = None
        self._last: tuple[Image, tuple[PlaceSighting, ...]] | None = None
        self._estimate: PoseEstimate | None = None
        self._wants = False

    def configure(self, parameters: PlaceParameters) -> None:
        """Use other parameters from now on.

        Raises:
            ParameterError: the global descriptor changed.
        """
        refuse_changes(FIXED, self.parameters, parameters)
        self.parameters = parameters
        if self._recogniser is not None:
            self._recogniser.parameters = parameters

    @property
    def wants_picture(self) -> bool:
        """Whether the camera should take a picture now: the robot is at a new place."""
        return self._wants

    @property
    def is_recording(self) -> bool:
        """Whether keyframes are recorded."""
        full = len(self._kept) >= MOST_KEYFRAMES
        return self.parameters.record and self._sees and not full

    @property
    def count(self) -> int:
        """Number of keyframes that pictures are compared with; 0 if they are too few."""
        return len(self._kept) if len(self._kept) >= LEAST_KEYFRAMES else 0

    def update(
        self, observation: Observation, frames: TransformBuffer, estimate: PoseEstimate,
        turning: float,
    ) -> None:  # fmt: skip
        """Store the scans of a step, and record its picture if it shows a new place.

        Args:
            observation: new measurements, scans deskewed.
            frames: with the poses at their stamps.
            estimate: of this step.
            turning: angular velocity, rad/s.
        """
        if not self._sees:
            return
        scan = observation.named(self._lidar, Scan)
        if scan is not None:
            self._scans.append(scan)
        before, self._estimate, self._wants = self._estimate, estimate, False
        jumped = before is not None and has_jumped(before, estimate)
        if jumped or estimate.ambiguous or not estimate.is_good:
            self._forget_pending()
            return
        self._settle(observation.time)
        image = next(iter(observation.of(Image).values()), None)
        if not self.is_recording or abs(turning) > FASTEST_TURN:
            return
        if image is not None:
            self._record(image, frames)
        self._wants = self._is_new(estimate.pose)

    def sightings(self, image: Image, frames: TransformBuffer) -> tuple[PlaceSighting, ...]:
        """Return the poses from which a picture can have been taken, most inliers first.

        The same picture is compared only once. The first call after new keyframes trains the
        vocabulary, which takes a second or two.
        """
        if not self.count:
            return ()
        if self._last is None or self._last[0] is not image:
            points = self._points_at(image.stamp, frames)
            seen = () if points is None else self._trained().recognise(image, points)
            self._last = image, seen
        return self._last[1]

    def files(self) -> dict[str, bytes]:
        """Return the file for the folder of a map, by name; empty without keyframes."""
        if not self.count:
            return {}
        trained = self._trained()
        complete = all(len(one.whole) for one in trained.keyframes)
        model = self._model if complete else ""
        return {FILE: keyframe_file(trained.keyframes, trained.vocabulary, model)}

    def load(self, folder: Path) -> None:
        """Replace all keyframes by those of a map's folder, which may have none.

        Raises:
            InputError: its file is damaged, or of another global descriptor; the old keyframes
                stay.
        """
        found = read_keyframes(folder)
        if found is not None and self._descriptor is not None:
            check_model(folder, found, self._descriptor.digest)
        self._forget_pending()
        self._recogniser, self._last = None, None
        self._kept = [] if found is None else found.keyframes
        self._looked = [(one.stamp, one.pose) for one in self._kept]
        if self._descriptor is None:
            self._model = "" if found is None else found.model
        if found is not None:
            self._recogniser = PlaceRecogniser(
                found.keyframes, self.parameters, found.vocabulary, self._descriptor
            )

    def _record(self, image: Image, frames: TransformBuffer) -> None:
        try:
            pose = frames.pose_at("map", image.stamp)
        except FrameError:
            return
        points = self._points_at(image.stamp, frames)
        if points is None or not self._is_new(pose):
            return
        self._looked.append((image.stamp, pose))
        keyframe = keyframe_of(image, pose, points, FEATURES)
        if keyframe is not None and self._descriptor is not None:
            whole = self._descriptor.describe(image.pixels).astype(np.float32)
            keyframe = replace(keyframe, whole=whole)
        if keyframe is not None:
            self._pending.append(keyframe)

    def _is_new(self, pose: Pose2D) -> bool:
        """Whether no picture was taken near a pose in about its direction."""
        p = self.parameters
        return not any(
            pose.distance_to(other) < p.keyframe_distance
            and abs(wrap_angle(pose.heading - other.heading)) < p.keyframe_angle
            for _, other in self._looked
        )

    def _settle(self, now: float) -> None:
        """Keep the pending keyframes that are old enough."""
        due = [one for one in self._pending if now - one.stamp >= self.parameters.settling_time]
        if due:
            self._kept += due
            self._pending = self._pending[len(due) :]
            self._recogniser = self._last = None

    def _forget_pending(self) -> None:
        if not self._pending:
            return
        stamps = {one.stamp for one in self._pending}
        self._pending = []
        self._looked = [one for one in self._looked if one[0] not in stamps]

    def _trained(self) -> PlaceRecogniser:
        if self._recogniser is None:
            self._recogniser = PlaceRecogniser(
                self._kept, self.parameters, descriptor=self._descriptor
            )
        return self._recogniser

    def _points_at(self, stamp: float, frames: TransformBuffer) -> FloatArray | None:
        """Return the points (n, 2) of the scan nearest to a stamp, base frame at that stamp."""
        near = [scan for scan in self._scans if abs(scan.stamp - stamp) <= LARGEST_AGE]
        if not near:
            return None
        scan = min(near, key=lambda one: (abs(one.stamp - stamp), one.stamp))
        try:
            points = frames.motion(stamp, scan.stamp).transform(scan.points())
        except FrameError:
            return None
        return np.asarray(points, dtype=np.float64)
