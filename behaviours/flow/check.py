"""Checking a condition."""

from __future__ import annotations

from py_trees.common import Status

from behaviours.base import RobotBehaviour, port
from stack.types import Expression, FailureCode


class Check(RobotBehaviour):
    """Succeed if a condition is true now; otherwise fail with CHECK_FAILED and its values."""

    also_known_as = (
        "ScriptCondition", "condition", "CheckBlackboardVariableExists",
        "CheckBlackboardVariableValue", "CheckBlackboardVariableValues",
        "CompareBlackboardVariables",
    )  # fmt: skip
    is_instant = is_condition = runs_in_tests = True
    fails_with = (FailureCode.CHECK_FAILED,)

    condition: Expression = port("condition that must be true")

    def update(self) -> Status:
        if self.condition():
            return Status.SUCCESS
        return self.fail(FailureCode.CHECK_FAILED, f"not true: {self.condition.explain()}")
