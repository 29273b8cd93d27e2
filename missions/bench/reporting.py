"""Parts shared by the reports of the benchmarks."""

from __future__ import annotations

from collections.abc import Sequence
from statistics import median

from missions.bench.runs import TrialRow

FIGURES = "  time s  driven / shortest  min clearance m"
"""Heading of `figures`."""


def figures(runs: Sequence[TrialRow]) -> str:
    """Return medians over the successful runs and their smallest clearance; "" without any."""
    good = [run for run in runs if run.success]
    if not good:
        return ""
    return (
        f"  {median(run.time for run in good):6.1f}"
        f"  {median(run.driven / run.path_length for run in good):17.2f}"
        f"  {min(run.clearance for run in good):15.3f}"
    )


def short(setup: str) -> str:
    """Return the label of a setup without its parameters, which are in settings.json."""
    return " ".join(word for word in setup.split() if "=" not in word)


def failures(runs: Sequence[TrialRow]) -> list[str]:
    """Return a line per failed run."""
    return [
        f"  {short(run.setup)}, {run.world} trial {run.trial}: {run.status}: {run.cause}"
        for run in runs
        if not run.success
    ]
