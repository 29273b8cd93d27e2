"""Waiting for a condition."""

from __future__ import annotations

from py_trees.common import Status

from behaviours.base import RobotBehaviour, port
from stack.types import Expression


class WaitUntil(RobotBehaviour):
    """Succeed as soon as a condition is true; add the modifier `timeout` to limit the wait."""

    also_known_as = ("WaitForBlackboardVariable", "WaitForBlackboardVariableValue")
    is_condition = runs_in_tests = True
    can_fail = False
    fails_with = ()

    condition: Expression = port("condition to wait for, evaluated on every tick")

    def update(self) -> Status:
        if self.condition():
            return Status.SUCCESS
        self.feedback_message = f"waiting for {self.condition.explain()}"
        return Status.RUNNING
