"""Object detection beside the step loop: one picture at a time, results at a fixed latency.

The detections of a picture that arrives at time t are used at t + latency on the robot's clock,
however long the model takes: the loop waits for a late result. On hardware they are used when they
come. A simulated run is therefore the same on every machine.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Protocol

import numpy as np

from stack.drivetrain.description import CAMERA
from stack.errors import ParameterError, WorkerError, exception_sentence, traceback_text
from stack.frames.buffer import TransformBuffer
from stack.parameters import refuse_changes
from stack.patience import Patience
from stack.perception.camera_lease import CameraLease
from stack.perception.objects.parameters import ObjectDetectorParameters
from stack.perception.objects.people import PeopleFinder
from stack.perception.objects.placing import Surroundings, depth_points, detection_of
from stack.types import (
    DepthImage,
    Detection,
    FloatArray,
    Image,
    Observation,
    ObstaclePoints,
    Pose2D,
    SeenObjects,
    TrackedObject,
)
from stack.worker_thread import WorkerThread

if TYPE_CHECKING:
    from stack.perception.objects.heads import Box
    from stack.perception.objects.model import ObjectModel

DEPTH_AGE = 0.3
"""Largest difference in seconds between the stamps of a picture and of a depth picture."""

FIXED = ("model", "labels", "label_file", "input_size")
"""Parameters that cannot be changed during a run."""


class Emit(Protocol):
    """Emits an event."""

    def __call__(self, kind: str, text: str, level: str = "info") -> None:
        """Emit an event of a kind and level with a sentence."""
        ...


def load_model(parameters: ObjectDetectorParameters) -> ObjectModel | None:
    """Load the model that the parameters name; None if they name none.

    Raises:
        InputError: it cannot be used.
    """
    if not parameters.model:
        return None
    from stack.perception.objects.model import ObjectModel  # imports OpenCV

    return ObjectModel(parameters)


@dataclass(frozen=True, slots=True)
class _Search:
    """A picture that is searched.

    Attributes:
        image: the picture.
        base: at its stamp, odom frame.
        around: what other sensors measured.
        due: time at which its detections are used, seconds.
        boxes: result of the model.
    """

    image: Image
    base: Pose2D
    around: Surroundings
    due: float
    boxes: Future[list[Box]]


class ObjectDetection:
    """Searches pictures for objects, and tells which tracks are people.

    Args:
        parameters: of the detection.
        model: that finds objects; None: only people are told, by their height in depth pictures.
        camera: kept on while pictures are searched.
        emit: receives events about problems, each once.
        log: receives tracebacks; not hashed.
        needed: whether a costmap layer needs detections all the time.
        is_real_time: of the body: results are used when they come, and not waited for.

    Attributes:
        newest: of the newest picture, the nearest first; None before the first one.
    """

    def __init__(  # noqa: PLR0913 - what it is connected with
        self, parameters: ObjectDetectorParameters, model: ObjectModel | None,
        camera: CameraLease, emit: Emit, log: Callable[[str], None], *, needed: bool = False,
        is_real_time: bool = False,
    ) -> None:  # fmt: skip
        self.parameters, self._model, self._camera = parameters, model, camera
        self._emit, self._log, self._needed = emit, log, needed
        self._lease = CameraLease()
        self._waits = not is_real_time
        self._worker = WorkerThread("the object detector")
        self._search: _Search | None = None
        self._people = PeopleFinder()
        self._depth: dict[str, DepthImage] = {}
        self._searched_at = -1.0
        self._told: set[str] = set()
        self.newest: tuple[Detection, ...] | None = None
        self._newest_stamp = 0.0

    @property
    def labels(self) -> tuple[str, ...]:
        """Labels of the model; empty without one."""
        return () if self._model is None else self._model.labels

    def configure(self, parameters: ObjectDetectorParameters) -> None:
        """Apply new parameters from the next picture on.

        Raises:
            ParameterError: the model or its input changed, or `only` has an unknown label.
        """
        refuse_changes(FIXED, self.parameters, parameters)
        for label in parameters.only:
            if self._model is not None and label not in self.labels:
                raise ParameterError("only", f"the model has no label {label!r}")
        self.parameters = parameters

    def request(self, now: float) -> None:
        """Search pictures during the next second."""
        self._lease.renew(now)

    def detections(self, now: float) -> tuple[Detection, ...] | None:
        """Return the newest detections and go on searching; None while there are no recent ones.

        They are of the newest picture that was searched, not older than `memory`.
        """
        self.request(now)
        return self.recent(now)

    def recent(self, now: float) -> tuple[Detection, ...] | None:
        """As `detections`, without asking for more."""
        old = now - self._newest_stamp > self.parameters.memory + self.parameters.latency
        return None if old else self.newest

    def forget(self) -> None:
        """Drop the newest detections, for example after a jump of the pose."""
        self.newest = None

    def update(
        self, observation: Observation, frames: TransformBuffer, obstacles: ObstaclePoints,
        tracks: Sequence[TrackedObject],
    ) -> SeenObjects:  # fmt: skip
        """Take a result that is due and submit a new picture; return what is new.

        Args:
            observation: the new measurements, with usable pictures only
                (stack/perception/cameras).
            frames: with the odometry and the estimate of this step.
            obstacles: points of the range sensors.
            tracks: moving objects after the last step, map frame.
        """
        now = observation.time
        depth = observation.of(DepthImage)
        self._depth |= depth
        found = self._result(now, frames)
        if self._is_on(now):
            self._camera.renew(now)
            image = observation.of(Image).get(CAMERA)
            if image is not None and self._is_due(image) and frames.covers(image.stamp):
                self._submit(image, now, frames, obstacles)
        views = (
            (image.stamp, _on_map(depth_points(image), frames.pose_at("map", image.stamp)))
            for image in depth.values() if frames.covers(image.stamp)
        )  # fmt: skip
        people = self._people.update(tracks, views, found or (), self.parameters.person_height)
        return SeenObjects(found, people)

    def await_result(self, now: float, longest: float) -> bool:
        """Wait at most `longest` wall seconds for a result that is due; return whether it is there.

        True also without one.
        """
        search = self._search
        if search is None or not self._waits or now < search.due - 1e-9:
            return True
        return self._worker.await_job(search.boxes, longest)

    def close(self) -> None:
        """Stop the worker; a search that has begun is finished."""
        self._worker.close()

    def _is_on(self, now: float) -> bool:
        wanted = self._needed or self.parameters.always or self._lease.is_active(now)
        return wanted and self._model is not None

    def _is_due(self, image: Image) -> bool:
        """Return whether a picture is to be searched: the last one is, and the rate allows it."""
        period = 1.0 / self.parameters.rate
        return self._search is None and image.stamp >= self._searched_at + period - 1e-6

    def _submit(
        self, image: Image, now: float, frames: TransformBuffer, obstacles: ObstaclePoints
    ) -> None:
        assert self._model is not None
        base, p = frames.pose_at("odom", image.stamp), self.parameters
        ranges = frames.pose_at("odom", now).transform(obstacles.points)
        around = Surroundings(base.inverse().transform(ranges), self._depth_at(image, base, frames))
        search = partial(self._model.boxes, image.pixels.copy(), p.threshold, p.overlap)
        boxes = self._worker.submit(search)
        self._search = _Search(image, base, around, now + p.latency, boxes)
        self._searched_at = image.stamp

    def _depth_at(self, image: Image, base: Pose2D, frames: TransformBuffer) -> FloatArray:
        """Return (n, 3) the points of depth pictures as old as a picture, base frame then."""
        parts: list[FloatArray] = [np.empty((0, 3))]
        for depth in self._depth.values():
            if abs(depth.stamp - image.stamp) <= DEPTH_AGE and frames.covers(depth.stamp):
                moved = frames.pose_at("odom", depth.stamp).relative_to(base)
                parts.append(_on_map(depth_points(depth), moved))
        return np.concatenate(parts)

    def _result(self, now: float, frames: TransformBuffer) -> tuple[Detection, ...] | None:
        """Return the detections of the searched picture if they are due."""
        search = self._search
        if search is None or now < search.due - 1e-9:
            return None
        if not self._waits and not search.boxes.done():
            if now > search.due + 1.0 / self.parameters.rate:
                self._tell(
                    "late",
                    f"the object detector needs more than {now - search.due:.1f} s beyond its "
                    "latency for a picture; use a smaller model or `input_size`",
                )
            if not Patience.is_over(search.due, now):
                return None
        self._search = None
        try:
            if not (self._waits or search.boxes.done()):
                raise self._worker.silence
            boxes = self._worker.result(search.boxes)
        except Exception as error:  # whatever a model and its library raise: the mission goes on
            self._log(traceback_text("the object detector failed", error))
            why = str(error) if isinstance(error, WorkerError) else exception_sentence(error)
            self._tell("failed", f"the object detector is off: {why}", "error")
            self._model, self.newest = None, None
            return None
        base = frames.map_from_odom(now).compose(search.base)
        self.newest, self._newest_stamp = self._placed(boxes, search, base), search.image.stamp
        return self.newest

    def _placed(self, boxes: list[Box], search: _Search, base: Pose2D) -> tuple[Detection, ...]:
        p, found = self.parameters, []
        for box in boxes:
            label = self.labels[box.label]
            if p.only and label not in p.only:
                continue
            item = detection_of(box, label, search.image, search.around, base)
            if item is not None and item.distance_to(base.x, base.y) <= p.farthest:
                found.append(item)
        return tuple(sorted(found, key=lambda item: item.distance_to(base.x, base.y)))

    def _tell(self, what: str, text: str, level: str = "warning") -> None:
        if what not in self._told:
            self._told.add(what)
            self._emit("detector", text, level=level)


def _on_map(points: FloatArray, base: Pose2D) -> FloatArray:
    """Return points (n, 3) of the base frame in the frame of the base's pose."""
    return np.column_stack([base.transform(points[:, :2]), points[:, 2]])
