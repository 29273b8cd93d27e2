"""Wait for something to become true."""

from __future__ import annotations

from py_trees.common import Status

from behaviours.base import RobotBehaviour, port
from stack.types import Expression


class WaitUntil(RobotBehaviour):
    """Succeed as soon as a condition holds; a `timeout` beside it limits the wait."""

    can_fail = False

    condition: Expression = port("what must become true, looked at on every tick")

    def update(self) -> Status:
        """Evaluate the condition, and show its values while it does not hold."""
        if self.condition():
            return Status.SUCCESS
        self.feedback_message = f"waiting for {self.condition.explain()}"
        return Status.RUNNING
