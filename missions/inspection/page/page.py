"""The HTML of a report: no scripts, nothing from the network, for light and dark screens."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import Any

import numpy as np

from missions.execution.repeat import first_difference
from missions.inspection.causes.html import causes_html
from missions.inspection.page.figures import RUN_COLOURS, map_figure, plot, timeline
from missions.inspection.page.story import Failing, Story
from stack.runtime.holdups import held_seconds
from stack.telemetry.records import ROUTINE
from stack.types.printable import printable

WORLD = "simulation"
"""Source of the events that tell what happened in the world."""

MOST_FAILURES, MOST_EVENTS = 30, 60

STYLE = """
:root { color-scheme: light dark; --paper: #fff; --ink: #1b2430; --dim: #667085; --line: #d8dee8;
  --panel: #f6f8fb; --good: #12805c; --bad: #c92a2a; --warn: #b25e00; --busy: #1f6feb;
  --run1: #1f6feb; --run2: #d9480f; --run3: #2b8a3e; --run4: #862e9c; }
@media (prefers-color-scheme: dark) { :root { --paper: #0b1018; --ink: #e6edf7; --dim: #93a5c1;
  --line: #24344f; --panel: #111a28; --good: #3ddc97; --bad: #ff6b6b; --warn: #ffc64d;
  --busy: #5aa2ff; --run1: #5aa2ff; --run2: #ff9b5a; --run3: #69db7c; --run4: #d0a2ff; } }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 16px; max-width: 1500px; background: var(--paper);
  color: var(--ink); font: 15px/1.5 system-ui, sans-serif; }
h1 { font-size: 1.5rem; margin: 0; } h2 { font-size: 1.05rem; margin: 1.4rem 0 .4rem; }
.runs { display: flex; flex-wrap: wrap; gap: 20px; } .run { flex: 1 1 340px; min-width: 0; }
.run.wide { flex-grow: 2; } .plots { display: grid; gap: 0 20px;
  grid-template-columns: repeat(auto-fit, minmax(min(100%, 440px), 1fr)); }
.word { font-weight: 700; } .word.success { color: var(--good); } .word.failure, .word.error {
  color: var(--bad); } .word.aborted, .word.interrupted { color: var(--warn); }
.lead { font-size: 1.05rem; margin: .3rem 0 .8rem; overflow-wrap: anywhere; }
.dim, .small { color: var(--dim); fill: var(--dim); } .small { font-size: 11px; }
svg { width: 100%; height: auto; display: block; font-family: system-ui, sans-serif; }
figure { margin: 0 0 10px; background: var(--panel); border: 1px solid var(--line);
  border-radius: 8px; padding: 8px; overflow: hidden; }
.tick { font-size: 10px; fill: var(--dim); }
.name { font-size: 12px; font-weight: 600; fill: var(--ink); }
.axis { stroke: var(--line); } .curve { fill: none; stroke-width: 1.4; }
image { image-rendering: pixelated; }
polyline { fill: none; stroke-width: 3; stroke-linejoin: round; stroke-linecap: round; }
.speed0 { stroke: #7048e8; } .speed1 { stroke: #4263eb; } .speed2 { stroke: #1098ad; }
.speed3 { stroke: #37b24d; } .speed4 { stroke: #f59f00; }
line.speed0, line.speed4 { stroke-width: 4; }
.heldmark { fill: none; stroke: var(--warn); stroke-width: 2.5; } .held { fill: var(--warn); }
.truth { stroke: var(--ink); stroke-width: 1.6; stroke-dasharray: 5 4; }
.moved { fill: var(--warn); stroke: var(--paper); }
.place { fill: none; stroke: var(--dim); }
.begin { fill: var(--paper); stroke: var(--ink); stroke-width: 2; }
.end { fill: var(--ink); } .mark { fill: var(--bad); font-size: 15px; font-weight: 700; }
.good { fill: var(--good); } .bad { fill: var(--bad); } .busy { fill: var(--busy); }
.idle { fill: var(--dim); opacity: .55; }
table { border-collapse: collapse; width: 100%; font-size: .88rem; }
td, th { text-align: left; vertical-align: top; padding: 3px 8px 3px 0;
  border-bottom: 1px solid var(--line);
  overflow-wrap: break-word; } th { color: var(--dim); font-weight: 500; }
td.number { white-space: nowrap; font-variant-numeric: tabular-nums; }
@media (max-width: 620px) { .map .small, .timeline .small, .timeline .tick { font-size: 16px; } }
code { font-size: .85rem; background: var(--panel); padding: 1px 4px; border-radius: 4px; }
.note { border-left: 4px solid var(--warn); background: var(--panel); padding: 8px 12px;
  border-radius: 4px; margin: 0 0 8px; } .note ul { margin: 4px 0; padding-left: 20px; }
td.source { white-space: nowrap; } tr.head th { white-space: nowrap; }
figure.timeline { max-width: 980px; }
@media (max-width: 620px) { .scroll tr { display: block; padding: 6px 0;
  border-bottom: 1px solid var(--line); } .scroll td { display: block; border: 0; padding: 1px 0; }
  .scroll tr.head { display: none; } }
.scroll { overflow-x: auto; } details > summary { cursor: pointer; color: var(--dim); }
"""

FIGURES = (
    ("seed", "{seed}", ("seed",)),
    ("driven", "{distance_m:.1f} m", ("distance_m",)),
    ("recoveries, replans", "{recoveries}, {replans}", ("recoveries", "replans")),
    ("real time", "{real_time_factor:.1f} ×", ("real_time_factor",)),
    ("contacts", "{collisions} by itself, {pushed_into} against it", ("collisions", "pushed_into")),
    ("least clearance", "{min_clearance_m:.2f} m", ("min_clearance_m",)),
    ("localisation error", "mean {mean:.3f} m, max {max:.3f} m", ("mean", "max")),
    ("event log", "{log_sha256:.16}", ("log_sha256",)),
)
"""Figures of a report: label, words, and the fields that they need."""


def page_of(stories: Sequence[Story]) -> str:
    """The page about one run, or about several side by side."""
    title = " and ".join(story.name for story in stories)
    parts = [f"<h1>{_safe(stories[0].title)}</h1>"]
    if len(stories) > 1:
        parts.append(f'<p class="note">{_safe(_difference(*stories[:2]))}</p>')
    if len(stories) == 1:
        parts.append(
            f'<div class="runs"><div class="run">{_outcome(stories[0])}</div>'
            f'<div class="run wide">{_map(stories[0])}</div></div>'
        )
    else:
        parts.append(_side_by_side(stories, _outcome))
        parts.append("<h2>Where it drove</h2>" + _side_by_side(stories, _map))
    parts.append(
        "<h2>What it did</h2>"
        + _side_by_side(stories, lambda one: _figure(timeline(one), "timeline"))
    )
    parts.append("<h2>What failed</h2>" + _side_by_side(stories, _failures))
    parts.append("<h2>Over time</h2>" + _plots(stories))
    parts.append(
        "<h2>What happened: warnings, errors, and events of the world</h2>"
        + _side_by_side(stories, _warnings)
    )
    parts.append("<h2>Settings and versions</h2>" + _side_by_side(stories, _settings))
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{_safe(title)}</title><style>{STYLE}</style></head><body>"
        + "\n".join(parts)
        + "</body></html>\n"
    )


def _difference(one: Story, other: Story) -> str:
    found = first_difference(one.events, other.events, (one.name, other.name))
    return found or "the two runs are equal, event by event"


def _safe(words: str) -> str:
    return escape(printable(words))


def _side_by_side(stories: Sequence[Story], part: object) -> str:
    assert callable(part)
    inside = "".join(f'<div class="run">{part(story)}</div>' for story in stories)
    return f'<div class="runs">{inside}</div>'


def _figure(content: str, kind: str = "plot") -> str:
    return f'<figure class="{kind}">{content}</figure>' if content else ""


def _outcome(story: Story) -> str:
    report, status = story.report, story.status
    sentence = f'<span class="word {_safe(status)}">{_safe(status)}</span> after {story.end:.1f} s'
    if report is None:
        sentence += "; it ended without a report: it was killed, or is not over"
    if story.reason:
        sentence += f": {_safe(story.reason)}"
    rows = [("run", story.name), ("robot", f"{story.robot} in {story.world}")]
    rows += _figures(report or {})
    held = [
        f"{effect} {seconds:.1f} s by {cause}"
        for effect, causes in held_seconds(story.events, story.end).items()
        for cause, seconds in causes.items()
    ]
    if held:
        rows.append(("held", "; ".join(held)))
    return f'<p class="lead">{sentence}</p>{causes_html(story)}{_table(rows)}'


def _figures(report: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return the figures of a report as rows; one that a version did not write has none."""
    error = report.get("localisation_error") or {}
    known = {name: value for name, value in {**report, **error}.items() if value is not None}
    return [
        (label, words.format_map(known))
        for label, words, names in FIGURES
        if all(name in known for name in names)
    ]


def _table(rows: Iterable[tuple[str, str]]) -> str:
    cells = "".join(
        f"<tr><th>{_safe(name)}</th><td>{_safe(value)}</td></tr>" for name, value in rows
    )
    return f"<table>{cells}</table>"


def _map(story: Story) -> str:
    return _figure(map_figure(story), "map")


def _failures(story: Story) -> str:
    if not story.failures:
        return "<p>No node failed.</p>"
    shown = story.failures[:MOST_FAILURES]
    more = len(story.failures) - len(shown)
    rest = f'<p class="dim">and {more} more: treepilot trace</p>' if more else ""
    rows = "".join(map(_failure_row, shown))
    return (
        '<div class="scroll"><table><tr class="head"><th>when</th><th>node</th><th>why</th>'
        f"<th>line of the mission</th></tr>{rows}</table></div>{rest}"
    )


def _failure_row(failing: Failing) -> str:
    times = ", ".join(f"{time:.1f} s" for time in failing.times[:4])
    if len(failing.times) > 4:
        times += f" … ({len(failing.times)} times)"
    line = f"<br><code>{_safe(failing.line)}</code>" if failing.line else ""
    path = _safe(" › ".join(failing.path[:-1]))
    return (
        f'<tr><td class="number">{times}</td><td>{_safe(failing.name)}<br>'
        f'<span class="dim small">{path}</span></td><td>{_safe(failing.message)}</td>'
        f"<td>{_safe(failing.where)}{line}</td></tr>"
    )


def _plots(stories: Sequence[Story]) -> str:
    end = max(story.end for story in stories)
    alone = len(stories) == 1

    def series(*fields: str) -> list[tuple[str, np.ndarray, np.ndarray, str]]:
        found = []
        for run, story in enumerate(stories):
            for number, name in enumerate(fields):
                colour = RUN_COLOURS[(number if alone else run) % len(RUN_COLOURS)]
                label = (
                    name.replace("_", " ")
                    if alone and len(fields) > 1
                    else ""
                    if alone
                    else story.name
                )
                values = getattr(story.samples, name)
                found.append((label, story.samples.time, values, colour))
        return found

    both = ("speed", "commanded", "true_speed") if alone else ("speed",)
    errors = ("error", "deviation") if alone else ("error",)
    figures = [
        plot("Speed", "m/s", series(*both), end, least_top=0.2),
        plot("Nearest thing in the scan", "m", series("nearest"), end, least_top=1.0),
        plot("Error and deviation of the pose" if alone else "Error of the pose", "m",
             series(*errors), end, least_top=0.1),
        plot("Health of the localisation", "", series("health"), end, least_top=1.0),
        plot("Compute time of a step", "ms", series("compute"), end, least_top=1.0),
    ]  # fmt: skip
    return f'<div class="plots">{"".join(map(_figure, figures))}</div>'


def _warnings(story: Story) -> str:
    told = [
        event
        for event in story.events
        if (event.level != "info" or event.source == WORLD) and event.kind not in ROUTINE
    ]
    if not told:
        return "<p>None.</p>"
    shown = told[:MOST_EVENTS]
    rows = "".join(
        f'<tr><td class="number">{event.time:.1f} s</td>'
        f'<td class="source">{_safe(event.source)}</td>'
        f"<td>{_safe(event.text)}</td></tr>"
        for event in shown
    )
    more = len(told) - len(shown)
    rest = f'<p class="dim">and {more} more in events.jsonl</p>' if more else ""
    return f'<div class="scroll"><table>{rows}</table></div>{rest}'


def _settings(story: Story) -> str:
    parts = []
    if story.facts.settings is None:
        parts.append("<p>The folder does not say which parameters were set.</p>")
    elif story.facts.settings:
        title = "<h3 class='small'>parameters that differ from their defaults</h3>"
        parts.append(title + _table(story.facts.settings.items()))
    else:
        parts.append("<p>All parameters have their defaults.</p>")
    if story.report is not None:
        versions, arguments = (story.report.get(name, {}) for name in ("versions", "arguments"))
        given = [(f"argument {name}", value) for name, value in arguments.items()]
        parts.append(
            f"<details><summary>versions</summary>{_table([*given, *versions.items()])}</details>"
        )
    return "".join(parts)
