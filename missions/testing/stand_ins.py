"""Mocks of behaviours and trees in mission tests."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from py_trees.common import Status

from behaviours.base import RobotBehaviour
from missions.language.case_model import FAILURE, RUNNING, SUCCESS, Mock
from missions.language.step import Step
from stack.types import FailureCode


class MockedRuns:
    """A mock and the number of its runs, over all nodes that it replaces."""

    def __init__(self, mock: Mock) -> None:
        self.mock, self.runs = mock, 0

    def next_run(self) -> tuple[str, float]:
        """Return outcome and duration (seconds) of the next run."""
        outcomes, times, run = self.mock.returns, self.mock.takes, self.runs
        self.runs += 1
        return outcomes[min(run, len(outcomes) - 1)], times[min(run, len(times) - 1)]


class StandIn(RobotBehaviour):
    """A behaviour with the outcomes and durations of a mock."""

    def __init__(self, name: str, runs: MockedRuns) -> None:
        super().__init__(name)
        self.runs = runs
        self.outcome, self.seconds = SUCCESS, 0.0

    def initialise(self) -> None:
        """Start the next run of the mock."""
        self.outcome, self.seconds = self.runs.next_run()
        self._timer = self.start_timer()

    def update(self) -> Status:
        """Return the outcome of the mock after its duration."""
        if self.outcome == RUNNING or not self._timer.is_over(self.seconds):
            return Status.RUNNING
        if self.outcome == SUCCESS:
            for name, value in self.runs.mock.sets.items():
                if name in self._writers:
                    self._writers[name](value)
            return Status.SUCCESS
        code = FailureCode.FAILED if self.outcome == FAILURE else self.outcome
        return self.fail(code, "mocked failure")


class MovingStandIn(StandIn):
    """A mock of a behaviour that moves the robot: pre-empted nodes are halted before it starts."""

    claims = ("base",)


class StandIns:
    """Selects the mock of a node: by its name, else by its behaviour or tree."""

    def __init__(self, mocks: Mapping[str, Mock]) -> None:
        self.runs = {name: MockedRuns(mock) for name, mock in mocks.items()}
        self.default = MockedRuns(Mock())

    def __call__(self, step: Step) -> RobotBehaviour | None:
        """Return the mock of a step; None to run the step itself."""
        runs = self.runs.get(step.name) or self.runs.get(step.own_name)
        if runs is None:
            if step.runs_in_tests:
                return None
            runs = self.default
        if runs.mock.is_real:
            return None
        cls = MovingStandIn if step.claims else StandIn
        return cls(step.name or step.own_name.rpartition(".")[2], runs)


def shown(value: Any) -> str:
    """Format an expected or actual value."""
    return "not set" if value is None else repr(value) if isinstance(value, str) else str(value)
