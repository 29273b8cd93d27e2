"""Table of the localisation bench: rates with confidence intervals, errors, calibration."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict
from math import sqrt
from statistics import mean
from typing import Any

import numpy as np

from missions.bench.localisation.experiments import EXPERIMENTS, LocalisationEntry, make_case
from missions.bench.localisation.monitor import BINS
from missions.bench.localisation.picture import draw_reliability
from missions.bench.localisation.runs import LocalisationRow, options_of, work_of
from missions.bench.resumable import TableOptions, fill, record_settings
from missions.execution.prepare import prepare
from stack.types import FloatArray

RELIABILITY = "reliability.png"


def measured(
    entries: Sequence[LocalisationEntry], parameters: dict[str, str], options: TableOptions,
    log: Callable[[str], None],
) -> list[LocalisationRow]:  # fmt: skip
    """Make the runs that are missing in the table, and draw the reliability of the health.

    Raises:
        InputError: the folder has results of other settings.
    """
    first = {entry.experiment: entry for entry in reversed(entries)}
    record_settings(options.out, {
        name: _settings(entry, parameters) for name, entry in first.items()
    })  # fmt: skip
    rows = fill(entries, options, work_of(parameters, options.out), log)
    bins = bins_of(rows)
    draw_reliability(options.out / RELIABILITY, bins, calibration_error(bins))
    return rows


def _settings(entry: LocalisationEntry, parameters: dict[str, str]) -> dict[str, Any]:
    case = make_case(entry)
    plan = prepare(case.mission, options_of(entry, case, parameters))
    chosen = plan.choices["localisation"]
    return {
        "experiment": asdict(EXPERIMENTS[entry.experiment]), "robot": plan.robot.name,
        "localisation": {"use": chosen.name, **asdict(chosen.parameters)},
        "parameters": parameters,
    }  # fmt: skip


def rows_of(rows: Sequence[LocalisationRow]) -> list[dict[str, object]]:
    """Return a row of figures for each experiment, in the order of EXPERIMENTS."""
    found = []
    for name in EXPERIMENTS:
        own = [row for row in rows if row.experiment == name]
        if own:
            found.append(_figures(name, own))
    return found


def report(rows: Sequence[LocalisationRow]) -> list[str]:
    """Return the table as lines: a line per experiment, the calibration, a line per failure."""
    table = rows_of(rows)
    if not table:
        return []
    heads = [head for head in table[0] if head != "failed"]
    widths = [max(len(head), *(len(str(row[head])) for row in table)) for head in heads]
    lines = ["  ".join(f"{head:<{w}}" for head, w in zip(heads, widths, strict=True))]
    for row in table:
        lines.append("  ".join(f"{row[h]!s:<{w}}" for h, w in zip(heads, widths, strict=True)))
    bins = bins_of(rows)
    lines.append(
        f"health: {bins[:, 0].sum():.0f} samples, expected calibration error"
        f" {calibration_error(bins):.3f}"
    )
    hours = sum(row.time for row in rows if row.experiment == "people") / 3600.0
    if hours:
        lost = sum(row.lost_falsely for row in rows if row.experiment == "people")
        lines.append(f"false LOST: {lost} in {hours:.2f} simulated hours of flats with people")
    return lines + [
        f"  {row.experiment} {row.kind} seed {row.seed}: {row.status}: {row.cause}"
        for row in rows
        if not row.success
    ]


def bins_of(rows: Sequence[LocalisationRow]) -> FloatArray:
    """Return the sum of the bins of all runs, (BINS, 3)."""
    return np.sum([np.array(row.bins) for row in rows], axis=0) if rows else np.zeros((BINS, 3))


def calibration_error(bins: FloatArray) -> float:
    """Return the mean difference of health and share of right poses, weighted by the samples.

    The expected calibration error after C. Guo et al., "On Calibration of Modern Neural
    Networks", ICML 2017, equation 3.
    """
    counts = bins[:, 0]
    if not counts.sum():
        return 0.0
    used = counts > 0
    gaps = np.abs(bins[used, 1] - bins[used, 2]) / counts[used]
    return float(gaps @ counts[used] / counts.sum())


def wilson(successes: int, trials: int) -> tuple[float, float]:
    """Return the 95 % confidence interval of a rate.

    E. B. Wilson, "Probable Inference, the Law of Succession, and Statistical Inference", Journal
    of the American Statistical Association 22, 1927.
    """
    if not trials:
        return 0.0, 1.0
    z, rate = 1.959964, successes / trials
    scale = 1.0 + z * z / trials
    middle = (rate + z * z / (2.0 * trials)) / scale
    half = z / scale * sqrt(rate * (1.0 - rate) / trials + z * z / (4.0 * trials * trials))
    return max(0.0, middle - half), min(1.0, middle + half)


def _figures(name: str, rows: Sequence[LocalisationRow]) -> dict[str, object]:
    passed = sum(row.success for row in rows)
    low, high = wilson(passed, len(rows))
    return {
        "experiment": name,
        "passed": f"{passed}/{len(rows)}",
        "95 % interval": f"{low:.0%} to {high:.0%}",
        "mean error": f"{100.0 * mean(row.error[0] for row in rows):.1f} cm",
        "largest": f"{max(row.error[1] for row in rows):.2f} m",
        "heading": f"{mean(row.turn[0] for row in rows):.2f} deg",
        "contained": f"{mean(row.contained for row in rows):.0%}",
        "noticed": _median([row.noticed for row in rows]),
        "corrected": _median([row.corrected for row in rows]),
        "false LOST": sum(row.lost_falsely for row in rows),
        "wrongly sure": f"{sum(row.wrong_claims for row in rows):.0f} s",
        "ambiguous": f"{sum(row.ambiguous for row in rows):.0f} s",
        "false goals": f"{sum(r.false_goals for r in rows)}/{sum(r.goals for r in rows)}",
        "failed": "; ".join(
            f"{row.kind} seed {row.seed}: {row.cause}" for row in rows if not row.success
        ),
    }


def _median(values: Sequence[float | None]) -> str:
    """Return the median of seconds; those never reached count as the longest."""
    known = sorted(value for value in values if value is not None)
    middle = (len(values) - 1) // 2
    if not known or middle >= len(known):
        return "never" if any(value is None for value in values) and known else "-"
    return f"{known[middle]:.1f} s"
