"""What the reports of several benchmarks say of runs."""

from __future__ import annotations

from collections.abc import Sequence
from statistics import median

from missions.bench.runs import Run

FIGURES = "  time s  way driven / shortest  least clearance m"
"""Heading of `figures`."""


def figures(runs: Sequence[Run]) -> str:
    """Medians over the successful runs, and the least clearance; nothing without any."""
    good = [run for run in runs if run.success]
    if not good:
        return ""
    return (
        f"  {median(run.time for run in good):6.1f}"
        f"  {median(run.driven / run.path_length for run in good):21.2f}"
        f"  {min(run.clearance for run in good):17.3f}"
    )


def short(setup: str) -> str:
    """A setup's label without the parameters in it; settings.json has them."""
    return " ".join(word for word in setup.split() if "=" not in word)


def failures(runs: Sequence[Run]) -> list[str]:
    """A line for each run that failed."""
    return [
        f"  {short(run.setup)}, {run.world} trial {run.trial}: {run.status}: {run.cause}"
        for run in runs
        if not run.success
    ]
