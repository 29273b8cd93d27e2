"""What a tuning came to: a table for people, JSON for machines, a parameter file for missions."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from missions.tuning.scoring import MEASURES, Measure, Score, best_first
from missions.tuning.tuning import Tuned
from stack.documents import as_yaml, value_of

TABLE, SCORES, BEST = "table.txt", "scores.json", "best.yaml"
BASELINE = "as it is"


def write_findings(tuned: Tuned, out: Path) -> list[Path]:
    """Write all three into a folder; the parameter file only where something beats the baseline."""
    contents = {TABLE: "\n".join(table_lines(tuned)) + "\n", SCORES: as_json(tuned)}
    if tuned.best.settings:
        contents[BEST] = parameter_file(tuned)
    else:
        (out / BEST).unlink(missing_ok=True)  # of an earlier, shorter tuning
    for name, text in contents.items():
        (out / name).write_text(text, "utf-8")
    return [out / name for name in contents]


def table_lines(tuned: Tuned) -> Iterator[str]:
    """Best first, the baseline marked; each figure with its difference to the baseline's."""
    baseline = tuned.scores[0]
    ranked = best_first(tuned.scores)
    names = [item.name for item in tuned.ranges]
    yield from _aligned([_header(names), *(
        [str(place), *_cells(score, baseline, names)] for place, score in enumerate(ranked, start=1)
    )])  # fmt: skip
    yield ""
    yield from verdict_lines(tuned)


def verdict_lines(tuned: Tuned) -> Iterator[str]:
    """What may be concluded, and what not."""
    best, seeds = tuned.best, len(tuned.scores[0].costs)
    if not best.settings:
        yield f"nothing that was tried ({len(tuned.scores) - 1}) beats the mission as it is"
        return
    others = len(tuned.scores) - 1
    yield f"best of {others} settings on {_runs(seeds)}: {_difference(best)}"
    if tuned.confirmed:
        yield f"the same on {_runs(len(best.costs), tuned)}: {_difference(tuned.confirmed[1])}"
    else:
        yield "the best of many looks better than it is: see --confirm"
    for line in shadowed(tuned):
        yield f"note: {line}"


def as_json(tuned: Tuned) -> str:
    """Everything that the table shows, and the costs seed by seed."""
    return json.dumps({
        "mission": tuned.plan.mission.source.name,
        "ranges": {item.name: list(item.values) or [item.low, item.high] for item in tuned.ranges},
        "scores": [_plain(score) for score in best_first(tuned.scores)],
        "confirmed": [_plain(score) for score in tuned.confirmed],
        "left_out": [{"settings": dict(one), "why": why} for one, why in tuned.left_out],
    }, indent=2, ensure_ascii=False)  # fmt: skip


def parameter_file(tuned: Tuned) -> str:
    """The best settings as a file that missions name under `parameters`."""
    section: dict[str, dict[str, Any]] = {}
    for name, text in tuned.best.settings.items():
        kind, _, parameter = name.partition(".")
        choice = tuned.plan.choices[kind]
        use = {} if choice.name == kind else {"use": choice.name}
        section.setdefault(kind, use)[parameter] = value_of(text)
    source = tuned.plan.mission.source.name
    remarks = [f"The best settings for {source}, by `treepilot tune`.", *verdict_lines(tuned)]
    return "".join(f"# {line}\n" for line in remarks) + as_yaml(section)


def shadowed(tuned: Tuned) -> Iterator[str]:
    """Settings that the mission makes itself, over any parameter file it names."""
    mission = tuned.plan.mission
    for name in tuned.best.settings:
        kind, _, parameter = name.partition(".")
        part = mission.navigation.get(kind)
        mark = None if part is None else part.marks.get(parameter)
        if mark is not None and Path(mark.file).name == mission.source.name:
            yield f"{mission.source.name}:{mark.line} sets {name} itself; change it there"


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
    settings = [score.settings.get(name, BASELINE) for name in names]
    is_baseline = not score.settings
    return [
        f"{score.cost:.3f}", f"{score.worst:.3f}",
        "baseline" if is_baseline else _with_noise(score),
        "" if is_baseline else score.verdict, f"{score.successes}/{runs}",
        *(_figure(measure, score.means, baseline.means) for measure in MEASURES), *settings,
    ]  # fmt: skip


def _figure(measure: Measure, means: Mapping[str, float], before: Mapping[str, float]) -> str:
    """A mean, and by how much it differs from the baseline's."""
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
        "one seed": "one seed says nothing of the noise; give --seeds 3 or more",
        "within noise": "no more than the seeds differ among themselves",
    }
    return f"cost {_with_noise(score)}, {means.get(score.verdict, score.verdict)}"


def _runs(seeds: int, tuned: Tuned | None = None) -> str:
    if tuned is not None:
        seeds = len(tuned.confirmed[1].costs)
        return f"{seeds} seeds not used to choose it" if seeds > 1 else "a seed not used before"
    return f"{seeds} seeds" if seeds > 1 else "one seed"


def _aligned(rows: Sequence[Sequence[str]]) -> Iterator[str]:
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        cells = (f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True))
        yield "  ".join(cells).rstrip()
