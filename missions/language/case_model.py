"""Cases under `tests`: a mission run without a robot, and what is expected of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from stack.documents import Mark, Node

SUCCESS, FAILURE, RUNNING = "success", "failure", "running"


@dataclass(frozen=True, slots=True)
class Mock:
    """What a behaviour or tree does in a test instead of what it does.

    Attributes:
        returns: outcome of each run in turn, the last one from then on: success, failure, running
            (it never ends) or the code of a failure.
        takes: seconds of each run in turn, likewise.
        sets: output -> value, written with each success.
        is_real: no mock at all: the behaviour itself runs.
    """

    returns: tuple[str, ...] = (SUCCESS,)
    takes: tuple[float, ...] = (0.0,)
    sets: Mapping[str, Any] = field(default_factory=dict)
    is_real: bool = False


@dataclass(frozen=True, slots=True)
class Change:
    """Something that happens at a moment of a test.

    Attributes:
        kind: value (of the robot) | key (of the blackboard) | event (comes, whatever its `when`).
    """

    at: float
    kind: str
    name: str
    value: Any = None


@dataclass(frozen=True, slots=True)
class Expectation:
    """What a test expects; what is None or empty is not looked at.

    Attributes:
        status: success | failure | running.
        failure: code of the first cause.
        keys: blackboard key -> value at the end.
        ran: name of a node, behaviour, tree or event -> least and most number of starts.
        order: names that start in this order, among others.
        within: seconds after which the mission has ended; else it is stopped there.
        within_each: name -> seconds that none of its runs exceeds.
        marks: where each of them stands: `status`, `ran charge`, `$visited`…
    """

    status: str | None = None
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
        arguments: name -> value as it stands there, already checked.
        mocks: name of a node, behaviour or tree -> what it does instead.
        changes: in the order of their times.
    """

    name: str
    mark: Mark
    arguments: Mapping[str, Node]
    mocks: Mapping[str, Mock]
    changes: tuple[Change, ...]
    expect: Expectation
