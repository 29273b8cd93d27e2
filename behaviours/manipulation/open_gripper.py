"""Opening a gripper."""

from __future__ import annotations

from py_trees.common import Status

from behaviours.base import RobotBehaviour, port
from stack.types import FailureCode


class OpenGripper(RobotBehaviour):
    """Open the gripper; what it holds is left where it is."""

    width: float | None = port(
        "distance between the fingers; default: as wide as they go", unit="m", default=None,
        at_least=0.0,
    )  # fmt: skip

    claims = ("gripper",)
    fails_with = (FailureCode.NO_PROGRESS,)

    def initialise(self) -> None:
        gripper = self.robot.gripper
        self._task = gripper.move(gripper.width_max if self.width is None else self.width)

    def update(self) -> Status:
        status = self.follow(self._task)
        if status is Status.SUCCESS:
            self.robot.arm.release()
        return status
