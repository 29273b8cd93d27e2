"""The HTML page about a tuning: front or progress, importance, seeds held out."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from missions.inspection.page.words import (
    cell,
    dim,
    document,
    numeric,
    safe,
    scroll,
    section,
    table,
)
from missions.tuning.objectives import Objective
from missions.tuning.scoring import Score, best_first

if TYPE_CHECKING:
    from missions.tuning.tuning import TuningResult

WIDTH, HEIGHT, MARGIN, RIGHT = 480, 240, 44, 24
"""Of a chart, in its own units."""

MOST_SHOWN = 20

OWN_STYLE = """
.front { fill: none; stroke: var(--good); stroke-width: 1.5; } .other { fill: var(--dim); }
.before { fill: none; stroke: var(--ink); stroke-width: 2; } figure.plot { max-width: 720px; }
"""

Point = tuple[float, float, str, str]
"""x, y, class of its mark, and words."""


def page_of(tuned: TuningResult, verdict: Sequence[str]) -> str:
    """Return the page.

    Args:
        tuned: the result.
        verdict: sentences about the best settings.
    """
    title = f"tuning of {tuned.plan.mission.source.stem}"
    chart = _front(tuned) if len(tuned.objectives) > 1 else _history(tuned)
    parts = [
        f'<h1>{safe(title)}</h1><p class="lead">{safe(verdict[0])}</p>',
        *(f"<p>{safe(line)}</p>" for line in verdict[1:]), chart,
        section("Importance", _importance(tuned)),
        section("Seeds held out", _held_out(tuned)), section("Settings", _settings(tuned)),
    ]  # fmt: skip
    return document(title, parts, OWN_STYLE)


def _front(tuned: TuningResult) -> str:
    """Return the settings by their first two objectives, those of the front joined."""
    x, y = tuned.objectives[:2]
    front = [score for score in tuned.front]
    points: list[Point] = [
        (score.mean(0), score.mean(1), _mark(score, front), _words(tuned, score))
        for score in tuned.scores if not score.is_pruned
    ]  # fmt: skip
    steps = [(score.mean(0), score.mean(1)) for score in front]
    caption = f"{_named(y)} over {_named(x)}; the front is green, the baseline a ring"
    if len(tuned.objectives) > 2:
        caption += "; further objectives are in the table"
    return _chart(caption, points, steps)


def _history(tuned: TuningResult) -> str:
    """Return the objective of each setting in their order, with the best so far."""
    objective = tuned.objectives[0]
    best, steps, points = tuned.scores[0].mean(), [], []
    for number, score in enumerate(tuned.scores):
        value = score.mean()
        if not score.is_pruned and objective.sign * (value - best) < 0.0:
            best = value
        steps.append((float(number), best))
        points.append((float(number), value, _mark(score, [tuned.best]), _words(tuned, score)))
    caption = f"{_named(objective)} of each setting, and the best so far; the baseline is a ring"
    return _chart(caption, points, steps)


def _mark(score: Score, best: Sequence[Score]) -> str:
    return "before" if not score.settings else "good" if score in best else "other"


def _words(tuned: TuningResult, score: Score) -> str:
    values = ", ".join(
        f"{_named(one)} {score.mean(number):.4g}" for number, one in enumerate(tuned.objectives)
    )
    settings = " ".join(f"{name}={text}" for name, text in score.settings.items())
    return f"{values}: {settings or 'unchanged mission'}{', pruned' * score.is_pruned}"


def _chart(caption: str, points: Sequence[Point], line: Sequence[tuple[float, float]]) -> str:
    xs, ys = [one[0] for one in points], [one[1] for one in points]
    right, up = WIDTH - MARGIN - RIGHT, HEIGHT - MARGIN - 10
    wide, high = max(xs) - min(xs) or 1.0, max(ys) - min(ys) or 1.0

    def at(x: float, y: float) -> tuple[float, float]:
        return (
            MARGIN + (x - min(xs)) / wide * right,
            10 + (max(ys) - y) / high * up,
        )

    path = " ".join(f"{px:.1f},{py:.1f}" for px, py in (at(*one) for one in line))
    parts = [
        f'<line x1="{MARGIN}" y1="{HEIGHT - MARGIN}" x2="{WIDTH - RIGHT}" y2="{HEIGHT - MARGIN}" '
        'class="axis"/>',
        f'<line x1="{MARGIN}" y1="10" x2="{MARGIN}" y2="{HEIGHT - MARGIN}" class="axis"/>',
        *(_tick(*at(x, min(ys)), f"{x:.3g}", 0.0, 16.0) for x in (min(xs), max(xs))),
        *(_tick(*at(min(xs), y), f"{y:.3g}", -22.0, 4.0) for y in (min(ys), max(ys))),
        f'<polyline points="{path}" class="front"/>',
    ]
    for x, y, mark, words in points:
        px, py = at(x, y)
        parts.append(
            f'<circle cx="{px:.1f}" cy="{py:.1f}" r="{7 if mark == "before" else 4}" '
            f'class="{mark}"><title>{safe(words)}</title></circle>'
        )
    heading = safe(caption)
    return (
        f'<figure class="plot"><figcaption>{heading}</figcaption>'
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{heading}">'
        f"{''.join(parts)}</svg></figure>"
    )


def _tick(x: float, y: float, words: str, right: float, down: float) -> str:
    return (
        f'<text x="{x + right:.1f}" y="{y + down:.1f}" class="tick" text-anchor="middle">{words}'
        "</text>"
    )


def _importance(tuned: TuningResult) -> str:
    if not any(tuned.importances):
        return ""
    rows = (
        [cell(factor.name),
         *(numeric(f"{one.get(factor.name, 0.0):.0%}") for one in tuned.importances)]
        for factor in tuned.factors
    )  # fmt: skip
    return table(["parameter", *map(_named, tuned.objectives)], rows) + dim(
        "How much it matters for being among the best tenth of the settings (PED-ANOVA)."
    )


def _held_out(tuned: TuningResult) -> str:
    """Return the values on the seeds of the search and on those held out, side by side."""
    if not tuned.held_out:
        return ""
    searched = {tuple(score.settings.items()): score for score in tuned.scores}
    rows = []
    for score in tuned.held_out:
        before = searched[tuple(score.settings.items())]
        words = " ".join(f"{name}={text}" for name, text in score.settings.items())
        means = (
            f"{one.mean(number):.4g}"
            for number in range(len(tuned.objectives)) for one in (before, score)
        )  # fmt: skip
        counts = f"{before.successes}/{before.seeds}, {score.successes}/{score.seeds}"
        rows.append([cell(words or "unchanged mission"), *map(numeric, (*means, counts))])
    heads = [head for one in tuned.objectives for head in (_named(one), "held out")]
    return table(["settings", *heads, "success"], rows) + dim(
        "Settings that are much better on the seeds of the search than on those held out fit the "
        "seeds, not the task."
    )


def _settings(tuned: TuningResult) -> str:
    rows = []
    for score in best_first(tuned.scores, tuned.objectives)[:MOST_SHOWN]:
        values = (f"{score.mean(number):.4g}" for number in range(len(tuned.objectives)))
        texts = (score.settings.get(factor.name, "unchanged") for factor in tuned.factors)
        counts = f"{score.successes}/{score.seeds}"
        rows.append([*map(numeric, (*values, counts)), *map(cell, texts)])
    names = [factor.name for factor in tuned.factors]
    return scroll(table([*map(_named, tuned.objectives), "success", *names], rows))


def _named(objective: Objective) -> str:
    return f"{objective.name} {objective.unit}".strip()
