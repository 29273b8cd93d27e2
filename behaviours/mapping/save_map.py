"""Saving of the map."""

from __future__ import annotations

from py_trees.common import Status

from behaviours.base import RobotBehaviour, output, port
from stack.errors import NavigationError


class SaveMap(RobotBehaviour):
    """Save the map as a folder: map.yaml and map.pgm, and the pose graph if the estimator has one.

    The folder is written whole or not at all; one that exists is kept as `.bak`. Other missions use
    it with `map: FOLDER` or `load_map`. Fails if it cannot be written.
    """

    path: str = port("folder; relative to the run folder, or absolute", default="map")
    saved: str = output("the folder that was written")

    needs = ("base",)
    fails_with = ()

    def update(self) -> Status:
        try:
            self.saved = self.robot.map.save(self.path)
        except NavigationError as error:
            return self.fail(error.failure.code, error.failure.sentence)
        self.feedback_message = f"saved {self.saved}"
        return Status.SUCCESS
