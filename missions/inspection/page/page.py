"""The HTML of a report: no scripts, nothing from the network, for light and dark screens."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from missions.execution.records.plan_facts import NotedSetting
from missions.inspection.causes.cause import Cause
from missions.inspection.causes.html import causes_html
from missions.inspection.causes.ranking import causes_of
from missions.inspection.causes.telling import headline
from missions.inspection.page.difference import difference
from missions.inspection.page.failed_nodes import FailedNode
from missions.inspection.page.map_figure import map_figure
from missions.inspection.page.plots import plot
from missions.inspection.page.story import Story
from missions.inspection.page.timeline import timeline
from missions.inspection.page.words import document, prose, safe
from stack.runtime.holdups import held_seconds
from stack.telemetry.records import ROUTINE, Event

UNTOLD = ROUTINE | {"goal", "plan", "mission_ended"}
"""Kinds of events that explain nothing, or that the headline tells."""

TURNS = frozenset({"held", "relocalised", "doubt", "failsafe", "recovery", "command", "reload"})
"""Kinds of events after which a run goes otherwise, also those that are no warnings."""

WORLD = "simulation"
"""Source of the events that tell what happened in the world."""

AT_ONCE = 0.5
"""Seconds from the failure of a motion to that of the node that wanted it."""

MOST_FAILURES, MOST_EVENTS = 30, 60

NO_DEFAULT = "—"

RUN_COLOURS = ("var(--run1)", "var(--run2)", "var(--run3)", "var(--run4)")


@dataclass(frozen=True)
class Told:
    """A run, and the likely causes of what went wrong in it."""

    story: Story
    causes: Sequence[Cause]


LABELS = {"speed": "by the wheels", "true_speed": "truly"}
"""Names of curves, where they are not those of the samples."""

FIGURES = (
    ("seed", "{seed}", ("seed",)),
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
    told = [Told(story, causes_of(story)) for story in stories]
    parts = [f"<h1>{safe(stories[0].title)}</h1>"]
    if len(told) > 1:
        parts.append(f'<p class="note">{prose(difference(*stories[:2]))}</p>')
        parts.append(_side_by_side(told, _outcome))
        parts.append("<h2>Where it drove</h2>" + _side_by_side(told, _map))
        parts.append("<h2>What it did</h2>" + _side_by_side(told, _timeline))
    else:
        parts.append(
            f'<div class="runs"><div class="run">{_outcome(told[0])}</div><div class="run wide">'
            f"{_map(told[0])}<h2>What it did</h2>{_timeline(told[0])}</div></div>"
        )
    parts.append("<h2>What failed</h2>" + _side_by_side(told, _failures))
    parts.append("<h2>What else happened</h2>" + _side_by_side(told, _events))
    parts.append("<h2>Over time</h2>" + _plots(stories))
    parts.append("<h2>Settings and versions</h2>" + _side_by_side(told, _settings))
    return document(_title(told), parts)


def _title(told: Sequence[Told]) -> str:
    """Name and outcome of a run, as in: run3: failure, sensor silent."""
    if len(told) > 1:
        return " and ".join(one.story.name for one in told)
    story, causes = told[0].story, told[0].causes
    why = causes[0].name if causes else "" if story.failed is None else story.failed.code
    return f"{story.name}: {story.status}" + (f", {why}" if why else "")


def _side_by_side(told: Sequence[Told], part: Callable[[Told], str]) -> str:
    inside = "".join(f'<div class="run">{part(one)}</div>' for one in told)
    return f'<div class="runs">{inside}</div>'


def _figure(content: str, kind: str = "plot") -> str:
    return f'<figure class="{kind}">{content}</figure>' if content else ""


def _outcome(told: Told) -> str:
    story = told.story
    words = prose(headline(story, told.causes))
    rows = [("run", story.name), ("robot", f"{story.robot} in {story.world}")]
    rows += _driven(story) + _figures(story.report or {})
    held = [
        f"{effect} {seconds:.1f} s by {cause}"
        for effect, causes in held_seconds(story.holds).items()
        for cause, seconds in causes.items()
    ]
    if held:
        rows.append(("held", "; ".join(held)))
    status = safe(story.status)
    lead = f'<p class="lead"><span class="word {status}">{status}</span> {words}</p>'
    return f"{lead}{causes_html(told.causes)}{_table(rows)}"


def _driven(story: Story) -> list[tuple[str, str]]:
    """Return how far the wheels drove, and in a simulation how far the robot really came."""
    wheels = (story.report or {}).get("distance_m")
    if wheels is None:
        return []
    truly = story.samples.true_distance
    real = f"; truly {truly:.1f} m" if np.isfinite(truly) else ""
    return [("driven", f"{wheels:.1f} m by the wheels{real}")]


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
    cells = "".join(f"<tr><th>{safe(name)}</th><td>{safe(value)}</td></tr>" for name, value in rows)
    return f"<table>{cells}</table>"


def _map(told: Told) -> str:
    return _figure(map_figure(told.story), "map")


def _timeline(told: Told) -> str:
    return _figure(timeline(told.story), "timeline")


def _failures(told: Told) -> str:
    rows: dict[tuple[int, int, str], list[FailedNode]] = {}
    for failed in told.story.failures.every:
        rows.setdefault((failed.tree, failed.id, failed.message), []).append(failed)
    if not rows:
        return "<p>No node failed.</p>"
    more = len(rows) - MOST_FAILURES
    rest = f'<p class="dim">and {more} more: treepilot trace</p>' if more > 0 else ""
    shown = "".join(map(_failure_row, list(rows.values())[:MOST_FAILURES]))
    return (
        '<div class="scroll"><table><tr class="head"><th>when</th><th>node</th><th>why</th>'
        f"<th>line of the mission</th></tr>{shown}</table></div>{rest}"
    )


def _failure_row(every: Sequence[FailedNode]) -> str:
    """The failures of a node for one reason."""
    failed = every[0]
    times = ", ".join(f"{one.time:.1f} s" for one in every[:4])
    if len(every) > 4:
        times += f" … ({len(every)} times)"
    line = f"<br><code>{safe(failed.line)}</code>" if failed.line else ""
    path = safe(" › ".join(failed.path))
    return (
        f'<tr><td class="number">{times}</td><td>{safe(failed.name)}<br>'
        f'<span class="dim small">{path}</span></td><td>{safe(failed.code)} '
        f"{prose(failed.message)}</td><td>{safe(failed.where)}{line}</td></tr>"
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
                    LABELS.get(name, name)
                    if alone and len(fields) > 1
                    else ""
                    if alone
                    else story.name
                )
                values = getattr(story.samples, name)
                found.append((label, story.samples.time, values, colour))
        return found

    def fresh_and_old(name: str) -> list[tuple[str, np.ndarray, np.ndarray, str]]:
        """Values by fresh scans, and in grey those by an old one."""
        found = []
        for story, one in zip(stories, series(name), strict=True):
            stale = story.samples.stale
            ends = stale & ~np.append(False, stale[:-1])  # the curves meet
            found.append((one[0], one[1], np.where(stale & ~ends, np.nan, one[2]), one[3]))
            if stale.any():
                old = np.where(stale, one[2], np.nan)
                found.append(("by an old scan", one[1], old, "var(--dim)"))
        return found

    both = ("speed", "commanded", "true_speed") if alone else ("speed",)
    errors = ("error", "deviation") if alone else ("error",)
    figures = [
        plot("Speed", "m/s", series(*both), end, least_top=0.2),
        plot("Nearest thing in the scan", "m", fresh_and_old("nearest"), end, least_top=1.0),
        plot("Error and deviation of the pose" if alone else "Error of the pose", "m",
             series(*errors), end, least_top=0.1),
        plot("Health of the localisation", "", fresh_and_old("health"), end, least_top=1.0),
        plot("Speed of the fastest joint", "rad/s", series("joints"), end, least_top=0.5),
        plot("Between the fingers", "mm", series("fingers"), end, least_top=20.0),
        plot("Force of the fingers", "N", series("grip"), end, least_top=5.0),
        plot("Compute time of a step", "ms", series("compute"), end, least_top=1.0),
    ]  # fmt: skip
    return f'<div class="plots">{"".join(map(_figure, figures))}</div>'


def _events(told: Told) -> str:
    """The most important events, in order of time."""
    story = told.story
    ranks = {event.number: _rank(story, event) for event in story.events}
    chosen = sorted(
        (event for event in story.events if ranks[event.number]),
        key=lambda event: -ranks[event.number],
    )
    shown = sorted(chosen[:MOST_EVENTS], key=lambda event: event.number)
    if not shown:
        return "<p>None.</p>"
    rows = "".join(
        f'<tr class="{safe(event.level)}"><td class="number">{event.time:.1f} s</td>'
        f'<td class="source">{safe(event.source)}</td>'
        f"<td>{prose(event.text)}</td></tr>"
        for event in shown
    )
    more = len(chosen) - len(shown)
    rest = f'<p class="dim">and {more} less important ones in events.jsonl</p>' if more else ""
    return f'<div class="scroll"><table>{rows}</table></div>{rest}'


def _rank(story: Story, event: Event) -> int:
    """How much an event explains; 0: nothing, or the page tells it elsewhere."""
    if event.kind in UNTOLD or (event.kind == "task" and _is_told(story, event)):
        return 0
    if event.level == "error":
        return 3
    return 2 if event.level == "warning" or event.source == WORLD or event.kind in TURNS else 1


def _is_told(story: Story, event: Event) -> bool:
    """Whether the node that wanted a motion tells its end: it was no failure, or failed with it."""
    return event.level == "info" or any(
        failed.code == event.fields.get("code") and 0.0 <= failed.time - event.time <= AT_ONCE
        for failed in story.failures.every
    )


def _settings(told: Told) -> str:
    story, parts = told.story, []
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
        f"<tr><td>{safe(name)}</td><td>{safe(one.value)}</td>"
        f'<td><span class="narrow">default </span>{safe(one.default or NO_DEFAULT)}</td>'
        f'<td><span class="narrow">set by </span>{safe(one.source)}</td></tr>'
        for name, one in settings.items()
    )
    return (
        "<p>Parameters that differ from their defaults:</p>"
        '<div class="scroll"><table><tr class="head"><th>parameter</th><th>value</th>'
        f"<th>default</th><th>set by</th></tr>{rows}</table></div>"
    )
