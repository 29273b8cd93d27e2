"""Finding the pose anywhere on the map."""

from __future__ import annotations

from py_trees.common import Status

from behaviours.base import RobotBehaviour, output, port
from stack.types import FailureCode


class LocaliseGlobally(RobotBehaviour):
    """Search the whole map for the pose that explains the lidar's scans, standing still.

    Fails with LOST if no pose explains them, and with AMBIGUOUS if several do: the others are then
    rivals of the estimate, which `disambiguate` tells apart.
    """

    also_known_as = ("ReinitializeGlobalLocalization",)

    unique: bool = port("fail if other poses explain the scans as well", default=True)
    rivals: int = output("number of other poses that explain the scans as well")

    needs = ("lidar",)
    takes_time = True
    claims = ("base",)
    fails_with = (FailureCode.LOST, FailureCode.AMBIGUOUS)

    def initialise(self) -> None:
        self._task = self.robot.localisation.relocalise()

    def update(self) -> Status:
        self.rivals = len(self.robot.localisation.estimate.rivals)
        failure = self._task.failure
        if failure is not None and failure.code == FailureCode.AMBIGUOUS and not self.unique:
            self.feedback_message = failure.sentence
            return Status.SUCCESS
        return self.follow(self._task)
