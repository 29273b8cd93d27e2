"""Runs among people with the verdict of the oracle: could anybody have passed?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from missions.bench.people_runs import (
    FALSE_GOAL,
    MISSION,
    TIME_LIMIT,
    PeopleEntry,
    PeopleRow,
    options_of,
    run_entry,
)
from missions.execution.prepare import prepare
from tests.benchmarks.oracle import Task, judge
from tests.benchmarks.oracle_picture import draw_verdict


@dataclass(frozen=True, slots=True)
class JudgedRow(PeopleRow):
    """One row of the table.

    Attributes:
        possible: whether anybody could have reached all goals without a contact; None where the
            oracle cannot tell. oracle_time: seconds, earliest arrival at the last goal.
    """

    possible: bool | None = None
    oracle_time: float | None = None


def run_judged(entry: PeopleEntry, picture: Path) -> JudgedRow:
    """Make one run; draw what the oracle found if it failed or nobody could have passed.

    Raises:
        InputError: the mission or a parameter has errors.
    """
    row, case = run_entry(entry, picture), entry.make(entry)
    plan = prepare(MISSION, options_of(entry, case))
    task = Task(plan.start, case.goals, FALSE_GOAL, TIME_LIMIT)
    verdict = judge(plan.world, plan.robot, entry.seed, task)
    if verdict is None:
        return JudgedRow(**asdict(row))
    if not (row.success and verdict.possible):
        draw_verdict(picture.with_stem(f"{picture.stem}-oracle"), verdict, case.goals)
    return JudgedRow(**asdict(row), possible=verdict.possible, oracle_time=verdict.time)


def impossible(rows: Sequence[JudgedRow]) -> str:
    """Return how many of the judged runs nobody could have passed."""
    judged = [row.possible for row in rows if row.possible is not None]
    return f"{judged.count(False)}/{len(judged)}" if judged else ""
