"""Take a picture and keep it."""

from __future__ import annotations

import re

from py_trees.common import Status

from behaviours.base import RobotBehaviour, output, port
from stack.types import FailureCode


class TakePhoto(RobotBehaviour):
    """Keep a picture that was exposed after the behaviour began; fails with NO_IMAGE."""

    takes_time = True

    label: str = port("begins the file's name", default="photo")
    patience: float = port("how long to wait for the camera", unit="s", default=2.0, above=0.0)
    image: str = output("path of the picture in the run's folder")

    def initialise(self) -> None:
        """Note from when on a picture is new enough."""
        self._started = self.robot.time

    def update(self) -> Status:
        """Look for a new picture; looking keeps the camera on."""
        picture = self.robot.image()
        if picture is not None and picture.stamp >= self._started:
            label = re.sub(r"[^\w-]+", "_", self.label)
            self.image = self.robot.save_image(picture, f"{label}_{picture.stamp:07.2f}s")
            self.feedback_message = self.image
            return Status.SUCCESS
        waited = self.robot.time - self._started
        if waited >= self.patience:
            return self.fail(
                FailureCode.NO_IMAGE, f"the camera gave no new picture within {self.patience:g} s"
            )
        self.feedback_message = "waiting for the camera"
        return Status.RUNNING
