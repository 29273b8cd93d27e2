"""Assignments to blackboard keys."""

from __future__ import annotations

from py_trees.common import Status

from behaviours.base import RobotBehaviour, port
from stack.types import Assignments


class Set(RobotBehaviour):
    """Write blackboard keys; all expressions are evaluated before the first key is written."""

    fails_with = ()

    assignments: Assignments = port("keys and expressions for their new values")

    def update(self) -> Status:
        """Evaluate all expressions, then write all keys: `{a: $b, b: $a}` swaps."""
        writes = self.assignments.writes
        values = [value() for _, value, _ in writes]
        for (_, _, write), value in zip(writes, values, strict=True):
            write(value)
        self.feedback_message = ", ".join(
            f"{key} = {value}" for (key, _, _), value in zip(writes, values, strict=True)
        )
        return Status.SUCCESS
