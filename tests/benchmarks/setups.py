"""Tables by setup: the label of a setup is replaced by what it chooses."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from missions.bench.bench import Rows
from missions.bench.goal_runs import Entry


def with_choices(table: Rows, entries: Sequence[Entry]) -> Rows:
    """Return a table with robot, controller and localisation in place of `setup`.

    Args:
        table: with a column `setup`.
        entries: of all setups.
    """
    first = {entry.label: entry for entry in reversed(entries)}
    chosen = {label: _choices(entry) for label, entry in first.items()}
    return [
        {**chosen[row["setup"]], **{name: row[name] for name in row if name != "setup"}}
        for row in table
    ]


def _choices(entry: Entry) -> dict[str, Any]:
    plan, _ = entry.setup.plan(entry.case, entry.trial)
    return {
        "robot": entry.setup.options.robot or plan.robot.name,
        "controller": plan.choices["controller"].name,
        "localisation": plan.choices["localisation"].name,
    }
