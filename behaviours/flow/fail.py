"""Failing on purpose."""

from __future__ import annotations

from py_trees.common import Status

from behaviours.base import RobotBehaviour, port
from stack.types import FailureCode


class Fail(RobotBehaviour):
    """Fail with a code and a reason, which recoveries, fallbacks and the report show."""

    also_known_as = ("abort", "raise", "AlwaysFailure")
    runs_in_tests = True
    can_succeed = False
    failure_ports = ("code", "because")

    because: str = port("reason, a sentence for the report")
    code: str = port("failure code: one of the list, or your own", default=str(FailureCode.FAILED))

    def update(self) -> Status:
        """Fail."""
        return self.fail(self.code, self.because)
