"""The BARN benchmark: which runs it is made of, and its report."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from missions.bench.barn_score import per_world, summary
from missions.bench.barn_worlds import find_worlds
from missions.bench.runs import Case, Entry, Run, Setup
from stack.errors import InputError


def barn_entries(
    worlds: Path, setups: Sequence[Setup], trials: int, only: tuple[str, ...] = ()
) -> list[Entry]:
    """Every world by every trial, for each setup in turn.

    Args:
        worlds: folder or file.
        setups: of one mission, with different controllers.
        trials: runs in each world.
        only: names of worlds; empty for all.

    Raises:
        InputError: no worlds, or none of such a name.
    """
    cases = _chosen(find_worlds(worlds), only)
    return [
        Entry(setup, case, trial) for setup in setups for trial in range(trials) for case in cases
    ]


def report(runs: Sequence[Run]) -> list[str]:
    """The whole table and the summary under it, in lines; for each setup."""
    lines: list[str] = []
    for label in dict.fromkeys(run.setup for run in runs):
        own = [run for run in runs if run.setup == label]
        lines += [label, *per_world(own), "", *summary(own), ""]
    return lines[:-1]


def _chosen(cases: list[Case], only: tuple[str, ...]) -> list[Case]:
    unknown = [name for name in only if name not in {case.name for case in cases}]
    if unknown:
        raise InputError(f"there is no world {unknown[0]!r} among the {len(cases)} here")
    return [case for case in cases if not only or case.name in only]
