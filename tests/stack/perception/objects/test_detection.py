"""Detection beside the loop: when results count, where the objects are, and what goes wrong."""

from dataclasses import replace
from math import pi
from threading import Event
from types import SimpleNamespace

import numpy as np
import pytest

from stack.errors import ParameterError
from stack.frames.buffer import TransformBuffer
from stack.patience import Patience
from stack.perception.camera_lease import CameraLease
from stack.perception.objects.detection import ObjectDetection
from stack.perception.objects.heads import Box
from stack.perception.objects.parameters import ObjectDetectorParameters
from stack.types import (
    CameraModel,
    DepthImage,
    Image,
    Observation,
    ObstaclePoints,
    Odometry,
    Pose2D,
    PoseEstimate,
    TrackedObject,
    Twist,
)

CAMERA = CameraModel(320, 240, 228.0, (0.1, 0.0, 0.4))
DEPTH = CameraModel(80, 60, 50.0, (0.1, 0.0, 0.4))
STANDING = Twist(0.0, 0.0)
PERIOD = 0.05

# A chair that stands 2 m before the camera at (2.1, 0): 0.5 m wide and 0.9 m high. Its foot is
# 228 * 0.4 / 2 = 45.6 rows below the middle, its top 228 * 0.5 / 2 = 57 rows above.
CHAIR = Box(1, 0.8, (131.5, 63.0, 188.5, 165.6))


class ToyModel:
    """Says what the test sets.

    Attributes:
        found: boxes, or an exception that is raised.
        searched: mean brightness of the pictures.
    """

    labels = ("person", "chair")

    def __init__(self, *found):
        self.found, self.searched, self.may_end = found, [], None

    def boxes(self, pixels, threshold, overlap):
        self.searched.append(float(pixels.mean()))
        if self.may_end is not None:
            self.may_end.wait(10.0)
        for item in self.found:
            if isinstance(item, Exception):
                raise item
        return [box for box in self.found if box.score >= threshold]


class Rig:
    """Detection with a robot that stands at a pose of the map; one step in 50 ms."""

    def __init__(
        self, model=None, *, at=Pose2D(0.0, 0.0), needed=True, is_real_time=False, **parameters
    ):
        self.camera, self.events, self.time = CameraLease(), [], 0.0
        self.frames, self.at = TransformBuffer(), at
        self.detection = ObjectDetection(
            ObjectDetectorParameters(**parameters), model, self.camera, self.emit, print,
            needed=needed, is_real_time=is_real_time,
        )  # fmt: skip
        self.obstacles, self.tracks = ObstaclePoints(), ()

    def emit(self, kind, text, level="info"):
        self.events.append((kind, level, text))

    def step(self, **sensors):
        """Take a step with measurements; return what is new."""
        self.frames.add(Odometry(self.time, Pose2D(0.0, 0.0), STANDING))
        self.frames.correct(PoseEstimate(self.at, np.eye(3), 1.0, self.at, self.time))
        seen = self.detection.update(
            Observation(self.time, sensors), self.frames, self.obstacles, self.tracks
        )
        self.time = round(self.time + PERIOD, 9)
        return seen

    def run(self, seconds, every=4):
        """Step with a picture in every fourth step; return the times of results with them."""
        results = []
        for number in range(round(seconds / PERIOD)):
            now = self.time
            seen = self.step(**({"camera": picture(now)} if number % every == 0 else {}))
            if seen.detections is not None:
                results.append((now, seen.detections))
        return results


def picture(stamp, value=100):
    return Image(stamp, np.full((240, 320, 3), value, np.uint8), CAMERA)


def depth_picture(stamp, columns=slice(30, 50), at=2.0, rows=slice(0, 60)):
    """A thing at a distance from the camera before nothing."""
    depth = np.full((60, 80), np.inf, np.float32)
    depth[rows, columns] = at
    return DepthImage(stamp, depth, DEPTH, 0.1, 6.0)


@pytest.fixture(autouse=True)
def rigs(monkeypatch):
    """Close the workers of all rigs."""
    made = []
    begin = Rig.__init__
    monkeypatch.setattr(
        Rig, "__init__", lambda rig, *args, **more: (made.append(rig), begin(rig, *args, **more))[1]
    )
    yield
    for rig in made:
        rig.detection.close()


def test_a_result_counts_exactly_after_the_latency():
    rig = Rig(ToyModel(CHAIR), latency=0.3)
    ((first, found), *_) = rig.run(1.0)
    assert first == 0.3
    assert [(item.label, item.stamp, item.score) for item in found] == [("chair", 0.0, 0.8)]


def test_pictures_are_searched_at_the_rate():
    rig = Rig(model := ToyModel(CHAIR), rate=2.0, latency=0.1)
    # Pictures come at multiples of 0.2 s: those at least 0.5 s apart are 0, 0.6, 1.2, 1.8.
    assert [time for time, _ in rig.run(2.0)] == pytest.approx([0.1, 0.7, 1.3, 1.9])
    assert len(model.searched) == 4


def test_the_picture_is_copied():
    rig = Rig(model := ToyModel(CHAIR))
    model.may_end = Event()
    image = picture(0.0)
    rig.step(camera=image)
    image.pixels[:] = 0
    model.may_end.set()
    rig.run(1.0)
    assert model.searched[0] == 100.0


def test_the_loop_waits_for_a_late_result():
    rig = Rig(model := ToyModel(CHAIR), latency=0.1)
    model.may_end = Event()
    rig.step(camera=picture(0.0))
    assert rig.detection.await_result(0.05, 0.0)  # not due
    assert not rig.detection.await_result(0.1, 0.001)
    model.may_end.set()
    assert rig.detection.await_result(0.1, 10.0)


def test_on_hardware_a_late_result_is_used_when_it_comes_and_told_once():
    rig = Rig(model := ToyModel(CHAIR), is_real_time=True, latency=0.1, rate=5.0)
    model.may_end = Event()
    assert rig.run(2.0) == []
    assert rig.detection.await_result(rig.time, 0.0)
    ((kind, level, text),) = rig.events
    assert (kind, level) == ("detector", "warning") and "use a smaller model" in text
    model.may_end.set()
    rig.detection._search.boxes.result(10.0)
    seen = rig.step()
    assert seen.detections[0].stamp == 0.0


def test_an_object_stands_where_the_floor_is():
    rig = Rig(ToyModel(CHAIR), at=Pose2D(1.0, 2.0, pi / 2))
    ((_, (chair,)), *_) = rig.run(0.5)
    assert chair.position == pytest.approx((1.0, 4.1), abs=0.02)
    assert (chair.width, chair.height) == pytest.approx((0.5, 0.9), abs=0.01)
    # A pixel is 2² / (228 · 0.4) = 4.4 cm of floor there.
    assert chair.deviation == pytest.approx(0.044, abs=0.002)


def test_range_sensors_and_depth_pictures_tell_more_than_the_floor():
    rig = Rig(ToyModel(CHAIR))
    face = np.column_stack([np.full(5, 2.05), np.linspace(-0.1, 0.1, 5)])
    rig.obstacles = ObstaclePoints(points=face)
    ((_, (chair,)), *_) = rig.run(0.5)
    assert chair.position == pytest.approx((2.05, 0.0), abs=0.01)
    rig = Rig(ToyModel(CHAIR))
    rig.step(camera=picture(0.0), depth=depth_picture(0.0, at=1.8))
    ((_, (chair,)), *_) = rig.run(0.5)
    # The box shows columns 30 to 49 of the depth picture: the thing 1.8 m before the camera.
    assert chair.position == pytest.approx((1.9, 0.0), abs=0.02)
    assert chair.deviation == 0.05


@pytest.mark.parametrize("value", [np.nan, np.inf, -1.0, 0.0])
def test_depth_without_values_leaves_the_floor(value):
    rig = Rig(ToyModel(CHAIR))
    rig.step(camera=picture(0.0), depth=depth_picture(0.0, at=value))
    ((_, (chair,)), *_) = rig.run(0.5)
    assert chair.position == pytest.approx((2.1, 0.0), abs=0.02)


def test_objects_that_nothing_places_and_far_ones_are_left_out():
    above = replace(CHAIR, corners=(131.0, 20.0, 189.0, 90.0))
    assert Rig(ToyModel(above)).run(0.5)[0][1] == ()
    assert Rig(ToyModel(CHAIR), farthest=1.5).run(0.5)[0][1] == ()
    assert Rig(ToyModel(CHAIR), only=["person"]).run(0.5)[0][1] == ()


def test_pictures_are_searched_only_while_somebody_asks():
    rig = Rig(model := ToyModel(CHAIR), needed=False)
    assert rig.run(1.0) == [] and not model.searched
    assert not rig.camera.is_active(rig.time)
    assert rig.detection.detections(rig.time) is None
    rig.step()
    assert rig.camera.is_active(rig.time)
    rig.run(0.9)
    (chair,) = rig.detection.recent(rig.time)
    assert chair.label == "chair"
    rig.run(4.0)
    assert rig.detection.recent(rig.time) is None  # older than `memory`
    assert Rig(ToyModel(CHAIR), needed=False, always=True).run(1.0)


def test_a_model_that_fails_is_told_once_and_the_rest_goes_on():
    rig = Rig(model := ToyModel(ValueError("no such layer")))
    assert rig.run(3.0) == []
    ((kind, level, text),) = rig.events
    assert (kind, level) == ("detector", "error")
    assert text.startswith("the object detector is off: ValueError: no such layer")
    assert len(model.searched) == 1
    assert rig.detection.detections(rig.time) is None


def test_a_picture_with_a_stamp_outside_the_buffer_is_not_searched():
    rig = Rig(model := ToyModel(CHAIR))
    rig.step(camera=picture(99.0))
    assert not model.searched


@pytest.mark.parametrize("is_real", [False, True])
def test_a_model_that_hangs_is_off_and_the_rest_goes_on(monkeypatch, is_real):
    monkeypatch.setattr(Patience, "LONGEST", 0.2)
    model = ToyModel(CHAIR)
    model.may_end = SimpleNamespace(wait=lambda _: Event().wait())
    rig = Rig(model, is_real_time=is_real, latency=0.3)
    assert rig.run(2.0) == []
    sentence = "the object detector is off: the object detector gave no result for 0.2 s"
    assert rig.events[-1] == ("detector", "error", sentence)
    assert rig.detection.await_result(rig.time, 1000.0)


def test_detections_are_placed_with_the_newest_correction():
    """The estimate is corrected by 0.5 m while the picture is searched."""
    rig = Rig(ToyModel(CHAIR))
    rig.step(camera=picture(0.0))
    rig.at = Pose2D(0.5, 0.0)
    ((_, (chair,)), *_) = rig.run(0.5)
    assert chair.position == pytest.approx((2.6, 0.0), abs=0.02)


def test_a_jump_of_the_pose_drops_what_was_placed_before():
    rig = Rig(ToyModel(CHAIR))
    rig.run(0.5)
    rig.detection.forget()
    assert rig.detection.recent(rig.time) is None


def test_thresholds_are_tuned_and_the_model_is_not():
    rig = Rig(ToyModel(CHAIR), rate=10.0, latency=0.0)
    assert rig.run(0.5)[-1][1]
    now = rig.detection.parameters
    rig.detection.configure(replace(now, threshold=0.9))
    assert rig.run(0.5)[-1][1] == ()
    with pytest.raises(ParameterError, match="model: cannot be changed during a run"):
        rig.detection.configure(replace(now, model="other.onnx"))
    with pytest.raises(ParameterError, match="the model has no label 'dog'"):
        rig.detection.configure(replace(now, only=["dog"]))


# People


def track(x, y=0.0, radius=0.25, number=1, stamp=0.0):
    return TrackedObject(number, stamp, (x, y), (0.0, 0.0), radius, np.eye(4))


def test_a_track_that_a_depth_camera_sees_to_be_tall_is_a_person():
    """60 rows at a focal length of 50: 2.1 m away it sees up to 0.4 + 2 · 30 / 50 = 1.6 m."""
    rig = Rig()
    rig.tracks = (track(2.1),)
    assert rig.step(depth=depth_picture(0.0)).people == {1}
    assert rig.step().people == {1}  # remembered, also when it comes near
    rig.tracks = ()
    assert rig.step().people == frozenset()


def test_a_chair_is_no_person_and_neither_is_what_stands_behind_it():
    # Rows from 20 on are at most 0.4 + 2 · 10 / 50 = 0.8 m high.
    rig = Rig()
    rig.tracks = (track(2.1),)
    assert rig.step(depth=depth_picture(0.0, rows=slice(20, 60))).people == frozenset()
    wall = depth_picture(0.0, columns=slice(0, 80), at=2.6)
    wall.depth[20:, 30:50] = 2.0
    assert rig.step(depth=replace(wall, stamp=0.05)).people == frozenset()


def test_a_higher_limit_is_obeyed():
    rig = Rig(person_height=1.8)
    rig.tracks = (track(2.1),)
    assert rig.step(depth=depth_picture(0.0)).people == frozenset()


@pytest.mark.parametrize(
    ("box", "people"),
    [
        # 1.7 m high 2 m away: 228 · 1.7 / 2 = 193.8 rows above the foot at 165.6; cut at 0: 1.45 m.
        (Box(0, 0.9, (131.5, 0.0, 188.5, 165.6)), {1}),
        (Box(1, 0.9, (131.5, 0.0, 188.5, 165.6)), set()),  # a tall chair
        (Box(0, 0.9, (131.5, 80.0, 188.5, 165.6)), set()),  # a picture of a person, 0.75 m high
        (Box(0, 0.9, (10.0, 0.0, 60.0, 165.6)), set()),  # beside the track
    ],
)
def test_a_track_that_the_model_calls_a_person_is_one_if_it_is_tall(box, people):
    rig = Rig(ToyModel(box))
    rig.tracks = (track(2.2),)
    rig.step(camera=picture(0.0))
    seen = [rig.step().people for _ in range(8)]
    assert seen[-1] == people
