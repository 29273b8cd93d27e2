"""Let the operator drive."""

from __future__ import annotations

from py_trees.common import Status

from behaviours.base import RobotBehaviour, port
from stack.types import FailureCode


class AssistedTeleop(RobotBehaviour):
    """Let the operator drive for a while; safety cuts what would touch something.

    The dashboard's arrow keys drive, enter ends it. Succeeds when the operator is done. Fails with
    TIMED_OUT, or NO_PROGRESS when nobody is at the keys.
    """

    time: float = port("that the operator has", unit="s", default=120.0, above=0.0)
    silence: float = port(
        "without a velocity from the operator after which it fails",
        unit="s",
        default=30.0,
        above=0.0,
    )
    time_over: str = port(
        "what it is when the time is over", default="failure", one_of=("failure", "success")
    )

    uses_wheels = True

    def initialise(self) -> None:
        """Hand over to the operator."""
        self.robot.say("the operator may drive: arrow keys, enter when done")
        self._task = self.robot.assisted_teleop(self.time, silence=self.silence)

    def update(self) -> Status:
        """Report on the time left."""
        status = self.follow(self._task)
        why = self._task.failure
        over = why is not None and why.code == FailureCode.TIMED_OUT
        if status is Status.FAILURE and over and self.time_over == "success":
            self.failure, self.feedback_message = None, "the time is over"
            return Status.SUCCESS
        return status
