"""Test cases of a mission: mocks, changes over time and expectations."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from stack.documents import Mark, Node

SUCCESS, FAILURE, RUNNING = "success", "failure", "running"


@dataclass(frozen=True, slots=True)
class Mock:
    """A mock of a behaviour or tree.

    Attributes:
        returns: outcome of each run in order; the last one repeats. success, failure, running (it
            never ends) or a failure code.
        takes: duration of each run in order, seconds; the last one repeats.
        sets: output -> value, written at each success.
        is_real: not mocked: the behaviour itself runs.
    """

    returns: tuple[str, ...] = (SUCCESS,)
    takes: tuple[float, ...] = (0.0,)
    sets: Mapping[str, Any] = field(default_factory=dict)
    is_real: bool = False


@dataclass(frozen=True, slots=True)
class Change:
    """A change at a time of a test.

    Attributes:
        at: simulated time, seconds.
        kind: value (of the robot) | key (of the blackboard) | event (fires regardless of `when`).
    """

    at: float
    kind: str
    name: str
    value: Any = None


@dataclass(frozen=True, slots=True)
class Expectation:
    """The expectations of a test; None and empty ones are not checked.

    Attributes:
        status: success | failure | running; without `status` in the file: success, or failure if
            a failure is expected.
        failure: code of the first cause.
        keys: blackboard key -> value at the end.
        ran: name of a node, behaviour, tree or event -> least and greatest number of starts.
        order: names in the order of their starts; others may start in between.
        within: time limit of the mission, seconds; it is stopped then.
        within_each: name -> longest duration of a run, seconds.
        marks: position of each expectation: `status`, `ran charge`, `$visited`…
    """

    status: str = SUCCESS
    failure: str | None = None
    keys: Mapping[str, Any] = field(default_factory=dict)
    ran: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    order: tuple[str, ...] = ()
    within: float | None = None
    within_each: Mapping[str, float] = field(default_factory=dict)
    marks: Mapping[str, Mark] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Case:
    """One entry of `tests`.

    Attributes:
        arguments: name -> value as written, already checked.
        mocks: name of a node, behaviour or tree -> its mock.
        changes: sorted by time.
    """

    name: str
    mark: Mark
    arguments: Mapping[str, Node]
    mocks: Mapping[str, Mock]
    changes: tuple[Change, ...]
    expect: Expectation
