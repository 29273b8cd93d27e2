"""Manual driving by the operator, with collision protection."""

from __future__ import annotations

from py_trees.common import Status

from behaviours.base import RobotBehaviour, port
from stack.types import FailureCode


class AssistedTeleop(RobotBehaviour):
    """Let the operator drive for a limited time; the safety stage prevents collisions.

    The arrow keys of the dashboard drive the robot; enter ends the behaviour with success. Fails
    with TIMED_OUT, or with NO_PROGRESS when no velocity arrives for `silence` seconds.
    """

    time: float = port("time limit for the operator", unit="s", default=120.0, above=0.0)
    silence: float = port(
        "time without a velocity command after which it fails",
        unit="s",
        default=30.0,
        above=0.0,
    )
    time_over: str = port(
        "outcome when the time limit is reached", default="failure", one_of=("failure", "success")
    )

    claims = ("base",)

    def initialise(self) -> None:
        self.robot.say("the operator may drive: arrow keys, enter when done")
        self._task = self.robot.base.assisted_teleop(self.time, silence=self.silence)

    def update(self) -> Status:
        status = self.follow(self._task)
        why = self._task.failure
        over = why is not None and why.code == FailureCode.TIMED_OUT
        if status is Status.FAILURE and over and self.time_over == "success":
            self.failure, self.feedback_message = None, "time limit reached"
            return Status.SUCCESS
        return status
