"""BARN benchmark: its runs and its report."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from missions.bench.barn_score import per_world, summary
from missions.bench.barn_worlds import find_worlds
from missions.bench.runs import Case, Entry, Setup, TrialRow
from stack.errors import InputError


def barn_entries(
    worlds: Path, setups: Sequence[Setup], trials: int, only: tuple[str, ...] = ()
) -> list[Entry]:
    """Return the runs of every setup, trial and world.

    Args:
        worlds: folder or file of worlds.
        setups: one mission with different controllers.
        trials: runs per world.
        only: names of the worlds to run; empty for all.

    Raises:
        InputError: there are no worlds, or a name is unknown.
    """
    cases = _selected(find_worlds(worlds), only)
    return [
        Entry(setup, case, trial) for setup in setups for trial in range(trials) for case in cases
    ]


def report(runs: Sequence[TrialRow]) -> list[str]:
    """Return the table of worlds and the summary of each setup, as lines."""
    lines: list[str] = []
    for label in dict.fromkeys(run.setup for run in runs):
        own = [run for run in runs if run.setup == label]
        lines += [label, *per_world(own), "", *summary(own), ""]
    return lines[:-1]


def _selected(cases: list[Case], only: tuple[str, ...]) -> list[Case]:
    unknown = [name for name in only if name not in {case.name for case in cases}]
    if unknown:
        raise InputError(f"--only: no world {unknown[0]!r} among the {len(cases)} worlds")
    return [case for case in cases if not only or case.name in only]
