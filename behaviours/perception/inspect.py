"""Taking a good picture of a place."""

from __future__ import annotations

from collections.abc import Generator
from math import hypot

from py_trees.common import Status

from behaviours._motion.driving import DrivingBehaviour, Steps
from behaviours._sensing.pictures import PictureQuality, picture_name, quality_of
from behaviours.base import DRIVE_FAILURES, output, port
from stack.robot import JsonValue
from stack.types import FailureCode, Image, Pose2D

STILL_SPEED, STILL_TURN, SETTLE = 0.01, 0.01, 0.3
"""m/s and rad/s below which the robot stands, and seconds for which it must."""


class Inspect(DrivingBehaviour):
    """Take a sharp, well exposed picture and save it with the robot's pose.

    Drives to `at` first, if it is set. Stands still, judges a new picture, and takes it again if it
    is blurred, dark or overexposed. The picture is saved with a JSON file of the same name: pose
    and its deviations, time, camera and quality. If no picture is good enough, the best one is
    saved all the same, and it fails with BAD_IMAGE; with NO_IMAGE if none arrives in time.
    """

    at: Pose2D | None = port("where to take it, map frame; default: here", default=None)
    label: str = port("prefix of the file name", default="inspection")
    min_sharpness: float = port(
        "least sharpness, in [0, 1]: one minus the blur effect of Crété et al.", default=0.6,
        at_least=0.0, at_most=1.0,
    )  # fmt: skip
    min_brightness: float = port(
        "least mean brightness, in [0, 1]", default=0.1, at_least=0.0, at_most=1.0
    )
    max_brightness: float = port(
        "largest mean brightness, in [0, 1]", default=0.95, at_least=0.0, at_most=1.0
    )
    retakes: int = port("pictures after the first one", default=3, at_least=0, at_most=100)
    patience: float = port("time limit for a new picture", unit="s", default=3.0, above=0.0)
    image: str = output("path of the picture, relative to the folder of the run")
    sharpness: float = output("of the picture, in [0, 1]")
    brightness: float = output("mean of the picture, in [0, 1]")
    pose: Pose2D = output("of the robot when it was taken, map frame")
    taken: int = output("number of pictures taken")

    needs = ("camera",)
    claims = ("base",)
    takes_time = True
    fails_with = (*DRIVE_FAILURES, FailureCode.NO_IMAGE, FailureCode.BAD_IMAGE)
    goal_ports = ("at",)

    def initialise(self) -> None:
        self._best: tuple[float, Image, PictureQuality, Pose2D] | None = None
        self.taken = 0
        self._steps = self._inspect()

    def update(self) -> Status:
        return self.advance(self._steps)

    def _inspect(self) -> Steps:
        if self.at is not None:
            if not (yield from self.done(self.robot.base.navigate_to(self.at))):
                return False
        while self.taken <= self.retakes:
            yield from self._stand_still()
            picture = yield from self._new_picture()
            if picture is None:
                break
            if self._judge(picture):
                return self._save()
        return self._give_up()

    def _stand_still(self) -> Generator[None, None, None]:
        """Wait until the robot has stood for SETTLE."""
        timer = self.start_timer()
        while not timer.is_over(SETTLE):
            self.stand()
            self.robot.perception.image()  # a request keeps the camera on
            self.feedback_message = "standing still"
            yield
            speed = self.robot.base.speed
            turns = abs(speed.angular) > STILL_TURN
            if turns or hypot(speed.linear, speed.lateral) > STILL_SPEED:
                timer.restart()

    def _new_picture(self) -> Generator[None, None, Image | None]:
        """Wait for a picture that was taken from now on; None if there is none in time."""
        began, timer = self.robot.time, self.start_timer()
        while not timer.is_over(self.patience):
            picture = self.robot.perception.image()
            if picture is not None and picture.stamp >= began:
                return picture
            self.feedback_message = "waiting for the camera"
            yield
        return None

    def _judge(self, picture: Image) -> bool:
        """Return whether a picture is good enough; remember the best one."""
        quality = quality_of(picture)
        self.taken += 1
        exposed = self.min_brightness <= quality.brightness <= self.max_brightness
        rank = quality.sharpness + exposed
        if self._best is None or rank > self._best[0]:
            self._best = rank, picture, quality, self.robot.localisation.pose
        self.feedback_message = _described(quality)
        return exposed and quality.sharpness >= self.min_sharpness

    def _save(self) -> bool:
        """Save the best picture and write the outputs."""
        assert self._best is not None
        _, picture, quality, pose = self._best
        estimate = self.robot.localisation.estimate
        details: dict[str, JsonValue] = {
            "time": round(picture.stamp, 3), "frame": "map",
            "pose": {"x": round(pose.x, 4), "y": round(pose.y, 4),
                     "heading": round(pose.heading, 4)},
            "position_deviation": round(estimate.position_deviation, 4),
            "heading_deviation": round(estimate.heading_deviation, 4),
            "localisation_health": round(estimate.health, 3),
            "sharpness": round(quality.sharpness, 3), "brightness": round(quality.brightness, 3),
            "contrast": round(quality.contrast, 3), "taken": self.taken,
            "camera": {
                "width": picture.camera.width, "height": picture.camera.height,
                "focal_length": round(picture.camera.focal_length, 3),
                "position": [round(value, 4) for value in picture.camera.position],
                "pitch": round(picture.camera.pitch, 4), "yaw": round(picture.camera.yaw, 4),
            },
        }  # fmt: skip
        name = picture_name(self.label, picture.stamp)
        self.image = self.robot.save_image(picture, name, details=details)
        self.pose, self.sharpness = pose, quality.sharpness
        self.brightness = quality.brightness
        self.feedback_message = f"{self.image}: {_described(quality)}"
        return True

    def _give_up(self) -> bool:
        if self._best is None:
            sentence = f"the camera gave no new picture within {self.patience:g} s"
            self.fail(FailureCode.NO_IMAGE, sentence)
            return False
        self._save()
        wanted = (
            f"expected sharpness {self.min_sharpness:g} or more and brightness "
            f"{self.min_brightness:g} to {self.max_brightness:g}"
        )
        sentence = f"the best of {self.taken} pictures has {_described(self._best[2])}; {wanted}"
        self.fail(FailureCode.BAD_IMAGE, sentence)
        return False


def _described(quality: PictureQuality) -> str:
    return f"sharpness {quality.sharpness:.2f}, brightness {quality.brightness:.2f}"
