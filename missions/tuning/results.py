"""Results of a tuning as a table, as JSON and as parameter files."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from missions.tuning.objectives import MEASURES, Measure
from missions.tuning.page import page_of
from missions.tuning.scoring import Difference, Score, best_first
from missions.tuning.tuning import TuningResult
from stack.columns import columns
from stack.documents import as_yaml, value_of

TABLE, SCORES, BEST, PAGE = "table.txt", "scores.json", "best.yaml", "report.html"
FRONT = "front-{}.yaml"
UNCHANGED = "unchanged"
"""Value of a parameter in the table's row of the baseline."""


def write_findings(tuned: TuningResult, out: Path) -> list[Path]:
    """Write all files to a folder; parameter files only of settings that beat the baseline."""
    for file in [out / BEST, *out.glob(FRONT.format("*"))]:
        file.unlink(missing_ok=True)  # of an earlier tuning with fewer samples
    contents = {
        TABLE: "\n".join(table_lines(tuned)) + "\n", SCORES: as_json(tuned),
        PAGE: page_of(tuned, [*verdict_lines(tuned)]),
    }  # fmt: skip
    several = len(tuned.objectives) > 1
    for number, score in enumerate(tuned.front if several else [tuned.best], start=1):
        if score.settings:
            contents[FRONT.format(number) if several else BEST] = parameter_file(tuned, score)
    for name, text in contents.items():
        (out / name).write_text(text, "utf-8")
    return [out / name for name in contents]


def table_lines(tuned: TuningResult) -> Iterator[str]:
    """Yield the table, best setting first, each figure with its difference to the baseline.

    With several objectives the settings of the front come first.
    """
    front = tuned.front
    ranked = best_first(tuned.scores, tuned.objectives)
    if len(tuned.objectives) > 1:
        ranked = [*front, *(score for score in ranked if score not in front)]
    lines = [[str(place), *_cells(tuned, score)] for place, score in enumerate(ranked, start=1)]
    yield from columns([_header(tuned), *lines])
    yield ""
    yield from verdict_lines(tuned)


def verdict_lines(tuned: TuningResult) -> Iterator[str]:
    """Yield the statistical significance of the best settings, and notes."""
    others = len(tuned.scores) - 1
    best = [score for score in tuned.front if score.settings]
    if not best:
        yield f"none of the {others} settings beats the unchanged mission"
        return
    if len(tuned.objectives) == 1:
        yield f"best of {others} settings on {_runs(best[0].seeds)}: {_difference(tuned, best[0])}"
    else:
        yield f"* front: {len(best)} of {others} settings, on {_runs(best[0].seeds)}"
    for score in tuned.held_out[1:]:
        shown = "" if len(tuned.objectives) == 1 else f"{_settings(score)}: "
        held_out = f"{_runs(score.seeds)} held out" if score.seeds > 1 else "a seed held out"
        yield f"{shown}the same on {held_out}: {_difference(tuned, score)}"
    if not tuned.held_out:
        yield "the best of many settings is partly better by chance; use --confirm"
    for score in best:
        for line in shadowed(tuned, score):
            yield f"note: {line}"


def as_json(tuned: TuningResult) -> str:
    """Return the content of the table, and the values per seed, as JSON."""
    return json.dumps({
        "mission": tuned.plan.mission.source.name,
        "objectives": [
            {"name": one.name, "maximises": one.maximises} for one in tuned.objectives
        ],
        "factors": [factor.plain() for factor in tuned.factors],
        "scores": [_plain(score) for score in best_first(tuned.scores, tuned.objectives)],
        "front": [dict(score.settings) for score in tuned.front],
        "held_out": [_plain(score) for score in tuned.held_out],
        "importances": [dict(one) for one in tuned.importances],
        "left_out": [{"settings": dict(one), "why": why} for one, why in tuned.left_out],
    }, indent=2, ensure_ascii=False)  # fmt: skip


def parameter_file(tuned: TuningResult, score: Score) -> str:
    """Return settings as a parameter file for a mission's `parameters`."""
    section: dict[str, dict[str, Any]] = {}
    for name, text in score.settings.items():
        kind, dot, parameter = name.partition(".")
        if not dot:
            continue  # an argument, world, robot or start
        choice = tuned.plan.choices[kind]
        use = {} if choice.name == kind else {"use": choice.name}
        section.setdefault(kind, use)[parameter] = value_of(text)
    source = tuned.plan.mission.source.name
    remarks = [f"Settings for {source}, found by `treepilot tune`.", *verdict_lines(tuned)]
    return "".join(f"# {line}\n" for line in remarks) + as_yaml(section)


def shadowed(tuned: TuningResult, score: Score) -> Iterator[str]:
    """Yield notes on settings that the mission file itself overrides."""
    mission = tuned.plan.mission
    for name in score.settings:
        kind, _, parameter = name.partition(".")
        part = mission.components.get(kind)
        mark = None if part is None else part.marks.get(parameter)
        if mark is not None and Path(mark.file).name == mission.source.name:
            yield f"{mission.source.name}:{mark.line} overrides {name}; change it there"


def _plain(score: Score) -> dict[str, Any]:
    return {
        "settings": dict(score.settings), "values": [dict(one) for one in score.values],
        "differences": [
            {"mean": one.gain, "standard_error": one.noise, "verdict": one.verdict}
            for one in score.differences
        ],
        "successes": score.successes, "pruned": score.is_pruned, "means": dict(score.means),
    }  # fmt: skip


def _header(tuned: TuningResult) -> list[str]:
    heads = [cell for one in tuned.objectives for cell in (one.name, "difference", "")]
    units = [f"{measure.name} {measure.unit}".strip() for measure in MEASURES]
    return ["", *heads, "success", *units, *(factor.name for factor in tuned.factors)]


def _cells(tuned: TuningResult, score: Score) -> list[str]:
    before = tuned.scores[0].means
    cells = []
    for number, difference in enumerate(score.differences):
        verdict = "pruned" if score.is_pruned else difference.verdict
        cells += [
            f"{score.mean(number):.4g}", _with_noise(difference) if score.settings else "baseline",
            verdict if score.settings else "",
        ]  # fmt: skip
    settings = [score.settings.get(factor.name, UNCHANGED) for factor in tuned.factors]
    figures = (_figure(measure, score.means, before) for measure in MEASURES)
    return [*cells, f"{score.successes}/{score.seeds}", *figures, *settings]


def _figure(measure: Measure, means: Mapping[str, float], before: Mapping[str, float]) -> str:
    """Return a mean with its relative difference to the baseline."""
    if measure.name not in means:
        return "-"
    value = means[measure.name]
    reference = before.get(measure.name)
    if means is before or not reference:
        return f"{value:.3g}"
    return f"{value:.3g} {100.0 * (value / reference - 1.0):+.0f}%"


def _with_noise(difference: Difference) -> str:
    noise = "" if difference.noise is None else f" ± {difference.noise:.2g}"
    return f"{difference.gain:+.3g}{noise}"


def _difference(tuned: TuningResult, score: Score) -> str:
    means = {
        "one seed": "noise unknown with one seed; use --seeds 3 or more",
        "within noise": "not significant: within the noise of the seeds",
    }
    return "; ".join(
        f"{objective.name} {_with_noise(one)}{objective.unit and ' '}{objective.unit},"
        f" {means.get(one.verdict, one.verdict)}"
        for objective, one in zip(tuned.objectives, score.differences, strict=True)
    )


def _settings(score: Score) -> str:
    return " ".join(f"{name}={text}" for name, text in score.settings.items())


def _runs(seeds: int) -> str:
    return f"{seeds} seeds" if seeds > 1 else "one seed"
