"""Results of a tuning as a table, as JSON and as a parameter file."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from missions.tuning.scoring import MEASURES, Measure, Score, best_first
from missions.tuning.tuning import TuningResult
from stack.columns import columns
from stack.documents import as_yaml, value_of

TABLE, SCORES, BEST = "table.txt", "scores.json", "best.yaml"
UNCHANGED = "unchanged"
"""Value of a parameter in the table's row of the baseline."""


def write_findings(tuned: TuningResult, out: Path) -> list[Path]:
    """Write all files to a folder; the parameter file only if a setting beats the baseline."""
    contents = {TABLE: "\n".join(table_lines(tuned)) + "\n", SCORES: as_json(tuned)}
    if tuned.best.settings:
        contents[BEST] = parameter_file(tuned)
    else:
        (out / BEST).unlink(missing_ok=True)  # written by an earlier tuning with fewer samples
    for name, text in contents.items():
        (out / name).write_text(text, "utf-8")
    return [out / name for name in contents]


def table_lines(tuned: TuningResult) -> Iterator[str]:
    """Yield the table, best setting first, each figure with its difference to the baseline."""
    baseline = tuned.scores[0]
    ranked = best_first(tuned.scores)
    names = [item.name for item in tuned.ranges]
    yield from columns([_header(names), *(
        [str(place), *_cells(score, baseline, names)] for place, score in enumerate(ranked, start=1)
    )])  # fmt: skip
    yield ""
    yield from verdict_lines(tuned)


def verdict_lines(tuned: TuningResult) -> Iterator[str]:
    """Yield the statistical significance of the best setting, and notes."""
    best, seeds = tuned.best, len(tuned.scores[0].costs)
    if not best.settings:
        yield f"none of the {len(tuned.scores) - 1} settings beats the unchanged mission"
        return
    others = len(tuned.scores) - 1
    yield f"best of {others} settings on {_runs(seeds)}: {_difference(best)}"
    if tuned.confirmed:
        yield f"the same on {_runs(len(best.costs), tuned)}: {_difference(tuned.confirmed[1])}"
    else:
        yield "the best of many settings is partly better by chance; use --confirm"
    for line in shadowed(tuned):
        yield f"note: {line}"


def as_json(tuned: TuningResult) -> str:
    """Return the content of the table, and the costs per seed, as JSON."""
    return json.dumps({
        "mission": tuned.plan.mission.source.name,
        "ranges": {item.name: list(item.values) or [item.low, item.high] for item in tuned.ranges},
        "scores": [_plain(score) for score in best_first(tuned.scores)],
        "confirmed": [_plain(score) for score in tuned.confirmed],
        "left_out": [{"settings": dict(one), "why": why} for one, why in tuned.left_out],
    }, indent=2, ensure_ascii=False)  # fmt: skip


def parameter_file(tuned: TuningResult) -> str:
    """Return the best settings as a parameter file for a mission's `parameters`."""
    section: dict[str, dict[str, Any]] = {}
    for name, text in tuned.best.settings.items():
        kind, _, parameter = name.partition(".")
        choice = tuned.plan.choices[kind]
        use = {} if choice.name == kind else {"use": choice.name}
        section.setdefault(kind, use)[parameter] = value_of(text)
    source = tuned.plan.mission.source.name
    remarks = [f"The best settings for {source}, by `treepilot tune`.", *verdict_lines(tuned)]
    return "".join(f"# {line}\n" for line in remarks) + as_yaml(section)


def shadowed(tuned: TuningResult) -> Iterator[str]:
    """Yield notes on settings that the mission file itself overrides."""
    mission = tuned.plan.mission
    for name in tuned.best.settings:
        kind, _, parameter = name.partition(".")
        part = mission.components.get(kind)
        mark = None if part is None else part.marks.get(parameter)
        if mark is not None and Path(mark.file).name == mission.source.name:
            yield f"{mission.source.name}:{mark.line} overrides {name}; change it there"


def _plain(score: Score) -> dict[str, Any]:
    return {
        "settings": dict(score.settings), "cost": score.cost, "worst": score.worst,
        "difference": score.gain, "standard_error": score.noise, "verdict": score.verdict,
        "successes": score.successes, "costs": dict(score.costs), "means": score.means,
    }  # fmt: skip


def _header(names: Sequence[str]) -> list[str]:
    units = [f"{measure.name} {measure.unit}".strip() for measure in MEASURES]
    return ["", "cost", "worst", "difference", "", "success", *units, *names]


def _cells(score: Score, baseline: Score, names: Sequence[str]) -> list[str]:
    runs = len(score.costs)
    settings = [score.settings.get(name, UNCHANGED) for name in names]
    is_baseline = not score.settings
    return [
        f"{score.cost:.3f}", f"{score.worst:.3f}",
        "baseline" if is_baseline else _with_noise(score),
        "" if is_baseline else score.verdict, f"{score.successes}/{runs}",
        *(_figure(measure, score.means, baseline.means) for measure in MEASURES), *settings,
    ]  # fmt: skip


def _figure(measure: Measure, means: Mapping[str, float], before: Mapping[str, float]) -> str:
    """Return a mean with its relative difference to the baseline."""
    if measure.name not in means:
        return "-"
    value = means[measure.name]
    reference = before.get(measure.name)
    if means is before or not reference:
        return f"{value:.3g}"
    return f"{value:.3g} {100.0 * (value / reference - 1.0):+.0f}%"


def _with_noise(score: Score) -> str:
    noise = "" if score.noise is None else f" ± {score.noise:.3f}"
    return f"{score.gain:+.3f}{noise}"


def _difference(score: Score) -> str:
    means = {
        "one seed": "noise unknown with one seed; use --seeds 3 or more",
        "within noise": "not significant: within the noise of the seeds",
    }
    return f"cost {_with_noise(score)}, {means.get(score.verdict, score.verdict)}"


def _runs(seeds: int, tuned: TuningResult | None = None) -> str:
    if tuned is not None:
        seeds = len(tuned.confirmed[1].costs)
        return f"{seeds} seeds not used for the selection" if seeds > 1 else "a new seed"
    return f"{seeds} seeds" if seeds > 1 else "one seed"
