"""inspect and the quality of pictures, on pictures made by formulas."""

import numpy as np
import pytest
from py_trees.common import Status

from behaviours._sensing.pictures import picture_name, quality_of
from behaviours.perception.inspect import Inspect
from behaviours.testing import ScriptedRobot, halt, tick
from stack.types import CameraModel, FailureCode, Image, Pose2D, TaskStatus, Twist

MODEL = CameraModel(160, 120, 114.0, (0.12, 0.0, 0.35))


def board(light=1.0, blur=0, columns=True):
    """A picture of a board with squares of 16 pixels, blurred along the rows by a mean filter."""
    x, y = np.meshgrid(np.arange(160), np.arange(120))
    grey = 60.0 + 120.0 * (((x // 16) + (y // 16)) % 2)
    if blur:
        kernel = np.ones(blur) / blur
        axis = 1 if columns else 0
        grey = np.apply_along_axis(lambda line: np.convolve(line, kernel, "same"), axis, grey)
    pixels = np.clip(np.repeat((light * grey)[:, :, None], 3, axis=2), 0, 255).astype(np.uint8)
    return pixels


def image(stamp, pixels):
    return Image(stamp, pixels, MODEL)


def test_an_ideal_edge_is_as_sharp_as_the_window_says():
    # A step becomes a ramp over 9 pixels: each of them keeps 1/9 of it, one of them takes 8/9 off.
    assert quality_of(image(0.0, board())).sharpness == pytest.approx(8.0 / 9.0, abs=0.01)


@pytest.mark.parametrize("columns", [True, False])
def test_blur_along_one_axis_is_found(columns):
    blurred = [quality_of(image(0.0, board(blur=n, columns=columns))).sharpness for n in (3, 5, 9)]
    assert blurred[0] > blurred[1] > blurred[2]
    assert blurred[1] < 0.6 and blurred[2] < 0.3


def test_sharpness_is_the_same_in_dim_light():
    bright, dim = quality_of(image(0.0, board())), quality_of(image(0.0, board(0.2)))
    assert dim.sharpness == pytest.approx(bright.sharpness, abs=0.01)
    assert dim.brightness == pytest.approx(0.2 * bright.brightness, rel=0.02)


def test_a_picture_of_nothing_is_not_sharp():
    noise = np.random.default_rng(1).normal(120.0, 1.0, (120, 160, 1)).repeat(3, axis=2)
    assert quality_of(image(0.0, noise.astype(np.uint8))).sharpness == 0.0


def test_names_are_safe():
    assert picture_name("the ../box 1", 12.345) == "the_box_1_0012.35s"


class Photographer(ScriptedRobot):
    """Takes a picture every 0.2 s; `shots` in turn, the last one again and again."""

    shots = ()

    def advance(self, seconds):
        super().advance(seconds)
        steps = round(self.time / 0.1)
        if self.shots and steps % 2 == 0:
            number = min(len(self.calls_of("asked")), len(self.shots) - 1)
            self.picture = image(self.time, self.shots[number])

    def judged(self, behaviour):
        self.calls += [("asked", {})] * (behaviour.taken - len(self.calls_of("asked")))


def run(behaviour, robot, seconds):
    behaviour.setup(robot=robot)
    behaviour.tick_once()
    for _ in range(round(seconds / 0.1)):
        if behaviour.status is not Status.RUNNING:
            break
        robot.advance(0.1)
        behaviour.tick_once()
        robot.judged(behaviour)
    return behaviour.status


def test_it_saves_a_sharp_picture_with_the_pose_beside_it():
    robot = Photographer(pose=Pose2D(1.0, 2.0, 0.5))
    robot.shots = (board(),)
    behaviour = Inspect(label="gauge")
    assert run(behaviour, robot, 5.0) is Status.SUCCESS
    (saved,) = robot.calls_of("save_image")
    assert saved["name"].startswith("gauge_")
    details = saved["details"]
    assert details["pose"] == {"x": 1.0, "y": 2.0, "heading": 0.5}
    assert details["time"] == saved["image"].stamp >= 0.3  # it stands for 0.3 s before
    assert details["sharpness"] == pytest.approx(behaviour.sharpness, abs=1e-3)
    assert behaviour.image.startswith("images/gauge_") and behaviour.taken == 1
    assert behaviour.pose == robot.pose


def test_it_takes_blurred_and_dark_pictures_again():
    robot = Photographer()
    robot.shots = (board(blur=9), board(0.05), board())
    behaviour = Inspect()
    assert run(behaviour, robot, 9.0) is Status.SUCCESS
    assert behaviour.taken == 3
    (saved,) = robot.calls_of("save_image")
    assert np.array_equal(saved["image"].pixels, board())


def test_it_fails_after_its_retakes_and_keeps_the_best():
    robot = Photographer()
    robot.shots = (board(blur=9), board(blur=5), board(blur=9))
    behaviour = Inspect(retakes=2)
    assert run(behaviour, robot, 9.0) is Status.FAILURE
    assert behaviour.failure.code == FailureCode.BAD_IMAGE
    assert "the best of 3 pictures has sharpness" in behaviour.failure.sentence
    (saved,) = robot.calls_of("save_image")
    assert np.array_equal(saved["image"].pixels, board(blur=5))


def test_overexposed_is_not_good_enough():
    robot = Photographer()
    robot.shots = (np.where(board() > 100, 255, 250).astype(np.uint8),)
    behaviour = Inspect(retakes=0)
    assert run(behaviour, robot, 3.0) is Status.FAILURE
    assert behaviour.failure.code == FailureCode.BAD_IMAGE


def test_it_waits_until_the_robot_stands():
    robot = Photographer(speed=Twist(0.2))
    robot.shots = (board(),)
    behaviour = Inspect()
    assert run(behaviour, robot, 2.0) is Status.RUNNING
    assert behaviour.taken == 0
    robot.speed = Twist()
    assert run(behaviour, robot, 2.0) is Status.SUCCESS


def test_without_a_camera_it_fails():
    behaviour = Inspect(patience=1.0)
    assert tick(behaviour, ScriptedRobot(), 5.0) is Status.FAILURE
    assert behaviour.failure.code == FailureCode.NO_IMAGE


def test_it_drives_first_and_reports_a_failed_drive():
    robot, behaviour = ScriptedRobot(), Inspect(at=Pose2D(3.0, 0.0))
    assert tick(behaviour, robot, 1.0) is Status.RUNNING
    assert robot.calls_of("navigate_to")[0]["goal"] == Pose2D(3.0, 0.0)
    robot.task.fail(FailureCode.NO_VALID_PATH, "no way")
    assert tick(behaviour, robot, 1.0) is Status.FAILURE
    assert behaviour.failure.code == FailureCode.NO_VALID_PATH


def test_it_cancels_the_drive_when_halted():
    robot, behaviour = ScriptedRobot(), Inspect(at=Pose2D(3.0, 0.0))
    tick(behaviour, robot)
    halt(behaviour)
    assert robot.calls_of("navigate_to") and robot.motion.status is TaskStatus.CANCELLED
