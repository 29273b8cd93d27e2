"""Runs one test case: ticks the compiled mission on a simulated clock."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from math import inf
from typing import Any

from behaviours.testing import TICK_PERIOD, ScriptedRobot
from behaviours.timer import ROUNDING
from missions.language.case_model import Case, Change, Expectation
from missions.language.expressions.scope import UNSET
from missions.language.model import Mission
from missions.testing.scripted_values import set_value
from missions.testing.stand_ins import StandIns, shown
from missions.trees.compiler import compile_mission
from missions.trees.context import Record
from missions.trees.mission_tree import MissionTree
from stack.documents import Mark
from stack.errors import TreepilotError, exception_sentence, traceback_text

DEFAULT_TIME_LIMIT = 3600.0
"""Simulated seconds after which a case without `within` is stopped."""

Place = tuple[Mark, str]
"""A node of the file: position and kind; a tree that is used twice has each node once."""


@dataclass(frozen=True)
class Problem:
    """One expectation that was not met."""

    mark: Mark
    what: str
    expected: str
    got: str


@dataclass
class CaseResult:
    """The result of a case.

    Attributes:
        seconds: simulated time.
        reached: the nodes that were ticked.
        outcome: outcome of the mission, as a sentence.
    """

    case: Case
    problems: list[Problem]
    seconds: float
    outcome: str
    reached: set[Place] = field(default_factory=set)

    @property
    def passed(self) -> bool:
        """Whether all expectations were met."""
        return not self.problems


def place_of(record: Record) -> Place:
    """Return the node of the file from which a node of the tree was compiled."""
    return record.mark, record.kind


def run_case(mission: Mission, case: Case) -> CaseResult:
    """Run a mission that was read with the case's arguments, and check the expectations.

    An exception, of a plugin or of treepilot, is a failure of the case; the others are still run.
    """
    try:
        return _Run(mission, case).result()
    except (Exception, SystemExit) as error:
        print(traceback_text(f"the test {case.name!r} crashed", error), file=sys.stderr)
        known = isinstance(error, TreepilotError)
        sentence = str(error) if known else exception_sentence(error)
        problem = Problem(case.mark, "crash", "no exception", sentence)
        return CaseResult(case, [problem], 0.0, "crashed")


class _Run:
    def __init__(self, mission: Mission, case: Case) -> None:
        self.case, self.robot = case, ScriptedRobot()
        self.tree: MissionTree = compile_mission(mission, stand_in=StandIns(case.mocks))
        self.tree.setup(self.robot.interface, self._on_event)
        self.tree.watch(self._on_start)
        self.started: list[Record] = []
        self.since: dict[int, float] = {}
        self.longest: dict[str, float] = {}
        self.by_id = {record.id: record for record in self.tree.records}

    def result(self) -> CaseResult:
        """Tick to the end, then check the expectations."""
        self._tick_to_the_end()
        status, seconds = self.tree.outcome, self.robot.time
        outcome = f"{status} after {seconds:.1f} s"
        if self.tree.reason:
            outcome = f"{outcome}: {self.tree.reason}"
        reached = {place_of(record) for record in self.started}
        problems = list(self._problems(self.case.expect))
        self.tree.halt()
        return CaseResult(self.case, problems, seconds, outcome, reached)

    def _tick_to_the_end(self) -> None:
        changes, count, done = self.case.changes, 0, 0
        end = (self.case.expect.within or DEFAULT_TIME_LIMIT) + ROUNDING
        while self.robot.time <= end:
            while done < len(changes) and changes[done].at <= self.robot.time + ROUNDING:
                self._change(changes[done])
                done += 1
            self.tree.tick()
            if self.tree.outcome != "running":
                return
            count += 1
            self.robot.time = round(count * TICK_PERIOD, 9)

    def _change(self, change: Change) -> None:
        if change.kind == "event":
            self.tree.force(change.name)
        elif change.kind == "key":
            self.tree.write(change.name, change.value)
        else:
            set_value(self.robot, change.name, change.value)

    def _on_start(self, record: Record) -> None:
        self.started.append(record)
        self.since[record.id] = self.robot.time

    def _on_event(self, kind: str, fields: Mapping[str, Any], **_: Any) -> None:
        if kind != "node_status" or fields["to"] not in ("success", "failure"):
            return
        began = self.since.get(fields["node"])
        if began is None:
            return
        for name in self.by_id[fields["node"]].names:
            self.longest[name] = max(self.longest.get(name, 0.0), self.robot.time - began)

    def _problems(self, expect: Expectation) -> Iterator[Problem]:
        outcome = self.tree.outcome
        if outcome == "running" != expect.status and expect.within is not None:
            yield self._problem("within", f"{expect.within:g} s", "still running")
        elif outcome != expect.status and expect.failure is None:
            at_limit = f" after {DEFAULT_TIME_LIMIT:g} s" if outcome == "running" else ""
            yield self._problem("status", expect.status, f"{outcome}{at_limit}")
        if expect.failure is not None:
            failure = self.tree.failure
            code = str(failure.code) if failure else f"none, {outcome}"
            if code != expect.failure:
                yield self._problem("failure", expect.failure, code)
        values = self.tree.values()
        for key, wanted in expect.keys.items():
            found = None if values[key] is UNSET else values[key]
            if found != wanted:
                yield self._problem(f"${key}", shown(wanted), shown(found))
        yield from self._counts(expect)
        yield from self._order(expect)
        for name, limit in expect.within_each.items():
            longest = self.longest.get(name, 0.0)
            if longest > limit + ROUNDING:
                yield self._problem(f"within {name}", f"{limit:g} s", f"{longest:g} s")

    def _counts(self, expect: Expectation) -> Iterator[Problem]:
        for name, (least, most) in expect.ran.items():
            count = sum(name in record.names for record in self.started)
            if not least <= count <= most:
                wanted = f"{least:g} times" if least == most else f"{least:g} to {most:g} times"
                wanted = wanted if most < inf else f"at least {least:g} times"
                yield self._problem(f"ran {name}", wanted, f"{count}")

    def _order(self, expect: Expectation) -> Iterator[Problem]:
        left = list(expect.order)
        for record in self.started:
            if left and left[0] in record.names:
                left.pop(0)
        if left:
            started = dict.fromkeys(
                name for record in self.started for name in record.names if name in expect.order
            )
            got = f"no later start of {left[0]}; first starts: {', '.join(started) or 'none'}"
            yield self._problem("order", ", ".join(expect.order), got)

    def _problem(self, what: str, expected: str, got: str) -> Problem:
        marks = self.case.expect.marks
        return Problem(marks.get(what, self.case.mark), what, expected, got)
