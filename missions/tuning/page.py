"""The HTML page about a tuning: front or progress, importance, seeds held out."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import TYPE_CHECKING

from missions.inspection.page.style import STYLE
from missions.tuning.objectives import Objective
from missions.tuning.scoring import Score, best_first
from stack.types.printable import printable

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
        f'<h1>{_safe(title)}</h1><p class="lead">{_safe(verdict[0])}</p>',
        *(f"<p>{_safe(line)}</p>" for line in verdict[1:]), chart,
        _section("Importance", _importance(tuned)),
        _section("Seeds held out", _held_out(tuned)), _section("Settings", _settings(tuned)),
    ]  # fmt: skip
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{_safe(title)}</title><style>{STYLE}{OWN_STYLE}</style></head><body>"
        + "\n".join(parts)
        + "</body></html>\n"
    )


def _section(title: str, content: str) -> str:
    return f"<h2>{title}</h2>{content}" if content else ""


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
            f'class="{mark}"><title>{_safe(words)}</title></circle>'
        )
    heading = _safe(caption)
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
    heads = "".join(f"<th>{_safe(_named(one))}</th>" for one in tuned.objectives)
    lines = "".join(
        f"<tr><td>{_safe(factor.name)}</td>"
        + "".join(f'<td class="number">{one.get(factor.name, 0.0):.0%}</td>'
                  for one in tuned.importances)
        + "</tr>"
        for factor in tuned.factors
    )  # fmt: skip
    return (
        f'<table><tr class="head"><th>parameter</th>{heads}</tr>{lines}</table><p class="dim">How '
        "much it matters for being among the best tenth of the settings (PED-ANOVA).</p>"
    )


def _held_out(tuned: TuningResult) -> str:
    """Return the values on the seeds of the search and on those held out, side by side."""
    if not tuned.held_out:
        return ""
    searched = {tuple(score.settings.items()): score for score in tuned.scores}
    heads = "".join(f"<th>{_safe(_named(one))}</th><th>held out</th>" for one in tuned.objectives)
    lines = ""
    for score in tuned.held_out:
        before = searched[tuple(score.settings.items())]
        cells = [
            f"{one.mean(number):.4g}"
            for number in range(len(tuned.objectives)) for one in (before, score)
        ]  # fmt: skip
        cells.append(f"{before.successes}/{before.seeds}, {score.successes}/{score.seeds}")
        words = " ".join(f"{name}={text}" for name, text in score.settings.items())
        numbers = "".join(f'<td class="number">{cell}</td>' for cell in cells)
        lines += f"<tr><td>{_safe(words or 'unchanged mission')}</td>{numbers}</tr>"
    return (
        f'<table><tr class="head"><th>settings</th>{heads}<th>success</th></tr>{lines}</table>'
        '<p class="dim">Settings that are much better on the seeds of the search than on those '
        "held out fit the seeds, not the task.</p>"
    )


def _settings(tuned: TuningResult) -> str:
    ranked = best_first(tuned.scores, tuned.objectives)[:MOST_SHOWN]
    heads = "".join(f"<th>{_safe(_named(one))}</th>" for one in tuned.objectives)
    names = "".join(f"<th>{_safe(factor.name)}</th>" for factor in tuned.factors)
    lines = ""
    for score in ranked:
        values = (f"{score.mean(number):.4g}" for number in range(len(tuned.objectives)))
        cells = "".join(
            f'<td class="number">{cell}</td>'
            for cell in (*values, f"{score.successes}/{score.seeds}")
        )
        texts = "".join(
            f"<td>{_safe(score.settings.get(factor.name, 'unchanged'))}</td>"
            for factor in tuned.factors
        )
        lines += f"<tr>{cells}{texts}</tr>"
    return (
        '<div class="scroll"><table><tr class="head">'
        f"{heads}<th>success</th>{names}</tr>{lines}</table></div>"
    )


def _named(objective: Objective) -> str:
    return f"{objective.name} {objective.unit}".strip()


def _safe(words: str) -> str:
    return escape(printable(words))
