"""The HTML page about a sweep, or about two: no scripts, nothing from the network."""

from __future__ import annotations

import shlex
from collections import Counter, defaultdict
from collections.abc import Sequence
from math import sqrt
from pathlib import Path
from statistics import mean, stdev

import numpy as np

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
from missions.sweeps.figures import MEASURES, SHOWN, Measure
from missions.sweeps.progress import rate_text
from missions.sweeps.report.charts import histogram, rates_chart
from missions.sweeps.report.comparison import compared
from missions.sweeps.report.places import failure_maps
from missions.sweeps.report.results import Level, Results, levels_of
from missions.sweeps.row import SweepRow, counted
from missions.sweeps.statistics import PERMUTATIONS, sensitivities

MOST_CLUSTERS, MOST_EXAMPLES = 30, 3

OWN_STYLE = """
.interval { stroke: var(--busy); stroke-width: 3; } .rate { fill: var(--ink); }
figure.map { max-width: 720px; }
.example code { user-select: all; white-space: nowrap; }
"""


def page_of(every: Sequence[Results]) -> str:
    """Return the page about one sweep, or two."""
    title = " and ".join(f"sweep {one.name}" for one in every)
    parts = [_comparison(*every)] if len(every) == 2 else []
    for results in every:
        parts.append(_about(results))
    return document(title, parts, OWN_STYLE)


def _about(results: Results) -> str:
    sweep, done = results.sweep, len(results.rows)
    runs = f"{done} of {sweep.runs} runs" if done < sweep.runs else f"{done} runs"
    mission, folder = safe(Path(sweep.mission).stem), safe(results.name)
    parts = [
        f"<h1>{mission} <span class='dim'>{folder}</span></h1>",
        f'<p class="lead">{safe(rate_text(results.rows))}; {runs}, {sweep.design}</p>',
        _outcomes(results),
        section("Success by factor", _rates(results)),
        section("Distributions", _distributions(results)),
        section("What failed", _clusters(results)),
        section("What matters", _sensitivity(results)),
        section("Where runs fail", _places(results)),
        section("Design", _design(results)),
    ]
    return "\n".join(parts)


def _outcomes(results: Results) -> str:
    counts = Counter(row.outcome for row in results.rows)
    words = [f"{outcome} {count}" for outcome, count in counts.most_common()]
    different = [row.number for row in results.rows if row.is_repeatable is False]
    note = ""
    if different:
        numbers = ", ".join(map(str, different[:20]))
        note = (
            f'<p class="note">Not repeatable: the runs {numbers} had other events when they ran'
            " again with records.</p>"
        )
    return f"<p>{safe(', '.join(words))}</p>{note}"


def _rates(results: Results) -> str:
    if not results.varied:
        return ""
    every = [(one.name, levels_of(one, results.varied)) for one in results.varying]
    charts = _side_by_side([rates_chart(name, levels) for name, levels in every])
    return charts + "".join(_means(name, levels) for name, levels in every)


def _means(name: str, levels: Sequence[Level]) -> str:
    """Return the means of the measures for each value of a factor."""
    measures = [MEASURES[one] for one in SHOWN]
    heads = [name, "success", *(f"{one.title}, {one.unit}" for one in measures)]
    rows = [
        [
            cell(level.name), numeric("{}/{}".format(*counted(level.rows))),
            *(numeric(_mean(one, level.rows)) for one in measures),
        ]
        for level in levels
    ]  # fmt: skip
    return scroll(table(heads, rows)) + dim(
        "Means with their standard errors; time and distance of the successes."
    )


def _mean(measure: Measure, rows: Sequence[SweepRow]) -> str:
    values = measure.judged(rows)
    if not values:
        return "–"
    error = f" ± {stdev(values) / sqrt(len(values)):.2g}" if len(values) > 1 else ""
    return f"{mean(values):.4g}{error}"


def _distributions(results: Results) -> str:
    charts = []
    for measure in map(MEASURES.__getitem__, SHOWN):
        good, bad = (
            np.array(measure.values([row for row in results.counting if row.is_success is wanted]))
            for wanted in (True, False)
        )
        charts.append(histogram(measure.title, measure.unit, good, bad))
    return _side_by_side(charts) + dim(
        'Number of runs; <span style="color: var(--good)">succeeded</span>, '
        '<span style="color: var(--bad)">did not</span>.'
    )


def _clusters(results: Results) -> str:
    """Return the failures that have outcome, cause, node and code in common."""
    found: dict[tuple[str, str, str, str], list[SweepRow]] = defaultdict(list)
    for row in results.rows:
        if not row.is_success:
            found[row.outcome, row.cause, row.node, row.code].append(row)
    ranked = sorted(found.items(), key=lambda item: -len(item[1]))[:MOST_CLUSTERS]
    if not ranked:
        return "<p>No run failed.</p>"
    lines = [
        [
            numeric(len(rows)), *map(cell, alike), cell(rows[0].reason),
            f"<td>{''.join(_example(results, row) for row in rows[:MOST_EXAMPLES])}</td>",
        ]
        for alike, rows in ranked
    ]  # fmt: skip
    heads = ("runs", "outcome", "cause", "node", "code", "the first one", "see it")
    return scroll(table(heads, lines))


def _example(results: Results, row: SweepRow) -> str:
    """Return the commands that show a kept run, or the one that makes it again."""
    commands = [run_command(results, row)]
    if row.folder:
        folder, here = results.folder / row.folder, Path.cwd()
        shown = str(folder.relative_to(here) if folder.is_relative_to(here) else folder)
        commands = [shlex.join(["treepilot", word, shown]) for word in ("report", "replay")]
    lines = "".join(f"<div><code>{safe(command)}</code></div>" for command in commands)
    return f'<div class="example"><b>{row.number}</b>{lines}</div>'


def run_command(results: Results, row: SweepRow) -> str:
    """Return the command that makes a run again, with its records."""
    options = results.sweep.options(row.settings, row.seed)
    mission = results.sweep.mission_of(row.settings)
    words = ["treepilot", "run", mission, "--seed", str(row.seed), "--forget-kept"]
    for option, value in (("--robot", options.robot), ("--world", options.world),
                          ("--start", options.start)):  # fmt: skip
        words += [] if value is None else [option, value]
    for option, values in (("--set", options.arguments), ("--parameter", options.parameters)):
        words += [word for name, text in (values or {}).items()
                  for word in (option, f"{name}={text}")]  # fmt: skip
    return shlex.join(words)


def _sensitivity(results: Results) -> str:
    """Return the factors by the share of the variance of success and time that they explain."""
    rows = results.varied
    if not results.varying or len(rows) < 2:
        return ""
    good = [row for row in rows if row.is_success and row.seconds is not None]
    tables = []
    for title, of, figure in (
        ("success", rows, [float(row.is_success) for row in rows]),
        ("time of the successes", good, [row.seconds or 0.0 for row in good]),
    ):
        if len(set(figure)) < 2:
            continue
        values = {
            factor.name: [factor.typed(row.settings[factor.name]) for row in of]
            for factor in results.varying
        }
        lines = [
            (cell(one.factor), numeric(f"{one.share:.1%}"), numeric(f"{one.p_value:.3f}"))
            for one in sensitivities(values, figure)
        ]
        tables.append(table((f"{title}: factor", "explains", "p"), lines))
    if not tables:
        return ""
    return _side_by_side([f'<div class="plot">{one}</div>' for one in tables]) + dim(
        "Share of the variance that the values of one factor explain (correlation ratio), less what"
        f" random groups of the same sizes explain; p: share of {PERMUTATIONS} permutations that"
        " explain as much. Factors that act only together are not seen."
    )


def _places(results: Results) -> str:
    maps = [
        f"<div class='run'>{f'<b>{safe(name)}</b>' if name else ''}{figure}</div>"
        for name, figure in failure_maps(results)
    ]
    return f'<div class="runs">{"".join(maps)}</div>' if maps else ""


def _design(results: Results) -> str:
    sweep = results.sweep
    lines = [("runs", f"{sweep.runs}, {sweep.design}, first seed {sweep.seed}"),
             ("time limit", f"{sweep.time_limit:g} s")]  # fmt: skip
    for factor in sweep.factors:
        unit = f" {factor.unit}" if factor.unit else ""
        drawn = f"{factor.kind}({factor.low:g}{unit}, {factor.high:g}{unit})"
        lines.append((factor.name, ", ".join(factor.values) if factor.is_list else drawn))
    lines += [*sweep.arguments.items(), *sweep.parameters.items()]
    versions = results.rows[-1].versions
    lines.append(("versions", ", ".join(f"{name} {text}" for name, text in versions.items())))
    rows = "".join(f"<tr><th>{safe(name)}</th><td>{safe(text)}</td></tr>" for name, text in lines)
    return f"<table>{rows}</table>"


def _comparison(first: Results, second: Results) -> str:
    heads = ("", first.name, second.name, "the second, compared with the first")
    lines = [
        [
            *map(cell, (one.figure, *one.values)),
            f"<td>{'<b>significant</b>: ' * one.is_significant}{safe(one.statement)}</td>",
        ]
        for one in compared(first, second)
    ]
    return f"<h1>{safe(first.name)} and {safe(second.name)}</h1>{table(heads, lines)}" + dim(
        "Medians; significance at 5 % each. With several rows, one of them is significant by "
        "chance more often than that."
    )


def _side_by_side(figures: Sequence[str]) -> str:
    return f'<div class="plots">{"".join(figures)}</div>' if any(figures) else ""
