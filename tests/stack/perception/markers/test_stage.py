"""When the stage takes pictures, and which of them correct the pose."""

from dataclasses import replace

import numpy as np

from stack.frames.buffer import TransformBuffer
from stack.perception.markers.detector import MarkerDetector
from stack.perception.markers.parameters import MarkerParameters
from stack.perception.markers.stage import MarkerStage
from stack.types import STANDSTILL, Observation, Odometry, Pose2D, PoseEstimate
from tests.stack.perception.markers.marker_pictures import CAMERA, WALL_MARKER, facing, rendered

ON = MarkerParameters(localise=True, rate=2.0, update_distance=0.1)
GOOD = PoseEstimate(Pose2D(0.0, 0.0), np.diag([1e-4] * 3), 0.9)


class Robot:
    """A stage that gets a picture in each step, 0.5 s apart, and the odometry of each."""

    def __init__(self, parameters, known=(WALL_MARKER,)):
        self.stage = MarkerStage(MarkerDetector(known, parameters, ["DICT_4X4_50"]), parameters)
        self.frames, self.time = TransformBuffer(), 0.0

    def step(self, pose: Pose2D, estimate: PoseEstimate = GOOD):
        self.time += 0.5
        self.frames.add(Odometry(self.time, pose, STANDSTILL))
        image = rendered(pose, [WALL_MARKER], CAMERA, np.random.default_rng(0))
        picture = Observation(self.time, {"camera": replace(image, stamp=self.time)})
        fix = self.stage.update(picture, self.frames)
        self.frames.correct(estimate)
        self.stage.add_views(picture, self.frames, estimate)
        return fix


def test_a_fix_needs_motion_since_the_last_one():
    robot = Robot(ON)
    first = robot.step(facing(1.5, 0.3, 0.0))
    assert first is not None and first.stamp == 0.5
    assert robot.step(facing(1.5, 0.3, 0.0)) is None  # the same errors again
    assert robot.step(facing(1.45, 0.3, 0.0)) is None  # 5 cm
    assert robot.step(facing(1.35, 0.3, 0.0)) is not None
    assert robot.step(facing(1.35, 0.3, 0.15)) is not None  # turned by 0.15 rad
    assert robot.stage.fixes == 3


def test_pictures_are_requested_at_the_rate_and_only_while_they_are_used():
    robot = Robot(ON)
    assert robot.stage.wants_picture(0.0)
    robot.step(facing(1.5, 0.3, 0.0))  # exposed at 0.5 s; 2 Hz
    assert not robot.stage.wants_picture(0.9)
    assert robot.stage.wants_picture(1.0)
    robot.stage.configure(replace(ON, localise=False))
    assert not robot.stage.wants_picture(9.0)
    assert not MarkerStage(None, ON).wants_picture(0.0)  # no camera


def test_only_unknown_markers_are_surveyed_and_only_at_a_good_pose():
    survey = replace(ON, localise=False, survey=True)
    lost = replace(GOOD, health=0.2)
    for known, estimate, views in (((), GOOD, 1), ((), lost, 0), ((WALL_MARKER,), GOOD, 0)):
        robot = Robot(survey, known)
        assert robot.step(facing(1.5, 0.3, 0.0), estimate) is None
        assert len(robot.stage.survey.views) == views
