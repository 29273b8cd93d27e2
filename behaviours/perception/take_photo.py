"""Taking and saving pictures."""

from __future__ import annotations

from py_trees.common import Status

from behaviours._sensing.pictures import picture_name
from behaviours.base import RobotBehaviour, output, port
from stack.types import FailureCode


class TakePhoto(RobotBehaviour):
    """Save a new picture of the camera; fails with NO_IMAGE if none arrives in time."""

    also_known_as = ("photo", "picture", "snapshot")
    needs = ("camera",)
    takes_time = True
    fails_with = (FailureCode.NO_IMAGE,)

    label: str = port("prefix of the file name", default="photo")
    patience: float = port("time limit for a new picture", unit="s", default=2.0, above=0.0)
    image: str = output("path of the picture, relative to the folder of the run")

    def initialise(self) -> None:
        """Start the timer; pictures from before the start do not count."""
        self._started = self.robot.time
        self._timer = self.start_timer()

    def update(self) -> Status:
        """Ask for a new picture; every request keeps the camera on."""
        picture = self.robot.perception.image()
        if picture is not None and picture.stamp >= self._started:
            name = picture_name(self.label, picture.stamp)
            self.image = self.robot.save_image(picture, name)
            self.feedback_message = self.image
            return Status.SUCCESS
        if self._timer.is_over(self.patience):
            return self.fail(
                FailureCode.NO_IMAGE, f"the camera gave no new picture within {self.patience:g} s"
            )
        self.feedback_message = "waiting for the camera"
        return Status.RUNNING
