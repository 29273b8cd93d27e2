"""Closing a gripper on something."""

from __future__ import annotations

from py_trees.common import Status

from behaviours._arm.acting import ArmBehaviour
from behaviours.base import output, port
from stack.types import FailureCode


class CloseGripper(ArmBehaviour):
    """Close the gripper until it holds something; fails with MISSED if it closes on nothing."""

    force: float | None = port(
        "with which the fingers press; default: the largest", unit="N", default=None, above=0.0
    )
    width: float = output("of what it holds", unit="m")

    claims = ("gripper",)
    fails_with = (FailureCode.MISSED, FailureCode.NO_PROGRESS)

    def initialise(self) -> None:
        self._steps = self.close(self.force)

    def update(self) -> Status:
        status = self.advance(self._steps)
        state = self.robot.gripper.state
        if status is Status.SUCCESS and state is not None:
            self.width = state.width
        return status
