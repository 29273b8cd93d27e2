"""The HTML of a report: no scripts, nothing from the network, for light and dark screens."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import Any

import numpy as np

from missions.execution.records.plan_facts import NotedSetting
from missions.execution.repeat import first_difference
from missions.inspection.causes.html import causes_html
from missions.inspection.page.map_figure import map_figure
from missions.inspection.page.plots import plot
from missions.inspection.page.story import Failing, Story
from missions.inspection.page.style import STYLE
from missions.inspection.page.timeline import timeline
from stack.runtime.holdups import held_seconds
from stack.telemetry.records import ROUTINE
from stack.types.printable import printable

WORLD = "simulation"
"""Source of the events that tell what happened in the world."""

MOST_FAILURES, MOST_EVENTS = 30, 60

NO_DEFAULT = "—"

RUN_COLOURS = ("var(--run1)", "var(--run2)", "var(--run3)", "var(--run4)")

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
        "<h2>What else happened: warnings, errors, and events of the world</h2>"
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
        plot("Speed of the fastest joint", "rad/s", series("joints"), end, least_top=0.5),
        plot("Between the fingers", "mm", series("fingers"), end, least_top=20.0),
        plot("Force of the fingers", "N", series("grip"), end, least_top=5.0),
        plot("Compute time of a step", "ms", series("compute"), end, least_top=1.0),
    ]  # fmt: skip
    return f'<div class="plots">{"".join(map(_figure, figures))}</div>'


def _warnings(story: Story) -> str:
    told = [
        event
        for event in story.events
        if (event.level != "info" or event.source == WORLD)
        and event.kind not in ROUTINE
        and not story.tells_failure(event)
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
        parts.append(_settings_table(story.facts.settings))
    else:
        parts.append("<p>All parameters have their defaults.</p>")
    if story.report is not None:
        versions, arguments = (story.report.get(name, {}) for name in ("versions", "arguments"))
        given = [(f"argument {name}", value) for name, value in arguments.items()]
        parts.append(
            f"<details><summary>versions</summary>{_table([*given, *versions.items()])}</details>"
        )
    return "".join(parts)


def _settings_table(settings: Mapping[str, NotedSetting]) -> str:
    rows = "".join(
        f"<tr><td>{_safe(name)}</td><td>{_safe(one.value)}</td>"
        f'<td><span class="narrow">default </span>{_safe(one.default or NO_DEFAULT)}</td>'
        f'<td><span class="narrow">set by </span>{_safe(one.source)}</td></tr>'
        for name, one in settings.items()
    )
    return (
        "<p>Parameters that differ from their defaults:</p>"
        '<div class="scroll"><table><tr class="head"><th>parameter</th><th>value</th>'
        f"<th>default</th><th>set by</th></tr>{rows}</table></div>"
    )
