"""What stands in for behaviours and trees while a mission is tested."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from py_trees.common import Status

from behaviours.base import RobotBehaviour
from missions.language.case_model import FAILURE, RUNNING, SUCCESS, Mock
from missions.language.model import Leaf, Use
from missions.trees.decorators import TOLERANCE
from stack.types import FailureCode

REAL = ("check", "set", "say", "wait", "wait_until")
"""Behaviours that need no robot but its clock and values; they are not replaced unless asked."""


class MockedRuns:
    """A mock and how often it has run, whichever nodes it stands for."""

    def __init__(self, mock: Mock) -> None:
        self.mock, self.runs = mock, 0

    def next_run(self) -> tuple[str, float]:
        """Outcome and duration of the run that begins."""
        outcomes, times, run = self.mock.returns, self.mock.takes, self.runs
        self.runs += 1
        return outcomes[min(run, len(outcomes) - 1)], times[min(run, len(times) - 1)]


class StandIn(RobotBehaviour):
    """Does what the mock says."""

    def __init__(self, name: str, runs: MockedRuns) -> None:
        super().__init__(name)
        self.runs = runs
        self.outcome, self.until = SUCCESS, 0.0

    def initialise(self) -> None:
        """Take the next outcome."""
        self.outcome, seconds = self.runs.next_run()
        self.until = self.robot.time + seconds

    def update(self) -> Status:
        """End when the time is over, as the mock says."""
        if self.outcome == RUNNING or self.robot.time < self.until - TOLERANCE:
            return Status.RUNNING
        if self.outcome == SUCCESS:
            for name, value in self.runs.mock.sets.items():
                if name in self._writers:
                    self._writers[name](value)
            return Status.SUCCESS
        code = FailureCode.FAILED if self.outcome == FAILURE else self.outcome
        return self.fail(code, "the test says so")


class MovingStandIn(StandIn):
    """As if it moved the robot: what it pre-empts is halted first."""

    uses_wheels = True


class StandIns:
    """Chooses what stands in: the mock of the node's name, else of its behaviour or tree."""

    def __init__(self, mocks: Mapping[str, Mock]) -> None:
        self.runs = {name: MockedRuns(mock) for name, mock in mocks.items()}
        self.done = MockedRuns(Mock())

    def __call__(self, step: Leaf | Use) -> RobotBehaviour | None:
        """The node that stands in; None leaves what the mission says."""
        kind = step.tree if isinstance(step, Use) else step.kind
        runs = self.runs.get(step.name) or self.runs.get(kind)
        if runs is None:
            if isinstance(step, Use) or kind in REAL or not step.behaviour.bindable:
                return None
            runs = self.done
        if runs.mock.is_real:
            return None
        moves = isinstance(step, Leaf) and step.behaviour.uses_wheels
        cls = MovingStandIn if moves else StandIn
        return cls(step.name or kind.rpartition(".")[2], runs)


def shown(value: Any) -> str:
    """An expected or found value in a report."""
    return "not set" if value is None else repr(value) if isinstance(value, str) else str(value)
