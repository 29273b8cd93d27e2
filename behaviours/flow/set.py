"""Assignments to blackboard keys."""

from __future__ import annotations

from typing import Any

from py_trees.common import Status

from behaviours.base import RobotBehaviour, port
from stack.types import Assignments

SHOWN_ITEMS, SHOWN_TEXT = 10, 500


class Set(RobotBehaviour):
    """Write blackboard keys; all expressions are evaluated before the first key is written."""

    also_known_as = ("Script", "SetBlackboard", "SetBlackboardVariable")
    is_instant = runs_in_tests = True
    fails_with = ()

    assignments: Assignments = port("keys and expressions for their new values")

    def update(self) -> Status:
        """Evaluate all expressions, then write all keys: `{a: $b, b: $a}` swaps."""
        writes = self.assignments.writes
        values = [value() for _, value, _ in writes]
        for (_, _, write), value in zip(writes, values, strict=True):
            write(value)
        self.feedback_message = ", ".join(
            f"{key} = {_brief(value)}" for (key, _, _), value in zip(writes, values, strict=True)
        )
        return Status.SUCCESS


def _brief(value: Any) -> str:
    """Format a value for the row of the node; long lists and texts are cut."""
    if isinstance(value, list) and len(value) > SHOWN_ITEMS:
        return f"{value[:SHOWN_ITEMS]}… ({len(value)} items)"
    text = str(value)
    return text if len(text) <= SHOWN_TEXT else f"{text[:SHOWN_TEXT]}…"
