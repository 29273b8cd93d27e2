"""The timeline of a report: when each node of the tree ran, what held the robot, and faults."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from html import escape

from missions.inspection.page.scales import time_steps
from missions.inspection.page.story import Story
from stack.types.limitations import SLOWER, STOPPED
from stack.types.printable import printable

MOST_ROWS = 60
"""Rows; deeper nodes are left out first."""

SPAN, LEAST_BAR = 1000.0, 2.0
"""Length of the run, and of the shortest bar, in the units of a row's drawing."""

OUTCOMES = {"success": "good", "failure": "bad", "idle": "idle", "running": "busy"}

Piece = tuple[float, float, str, str]
"""Begin and end, seconds; its colour, and what it is."""


def timeline(story: Story) -> str:
    """When each node of the tree ran, and how it ended; below, what held the robot, and faults."""
    rows = story.bars
    deepest = max((depth for depth, *_ in rows), default=0)
    while len(rows) > MOST_ROWS and deepest > 1:
        rows = [row for row in rows if row[0] < deepest]
        deepest -= 1
    parts = [
        _row(
            node.name, depth, story.end,
            ((bar.begin, bar.end, OUTCOMES.get(bar.outcome, "busy"), bar.outcome) for bar in bars),
        )
        for depth, node, bars in rows[:MOST_ROWS]
    ]  # fmt: skip
    held = defaultdict[str, list[Piece]](list)
    for hold in sorted(story.holds, key=lambda one: one.effect):  # stopped above slower
        held[hold.cause].append((hold.begin, hold.end, hold.effect, hold.effect))
    parts += [_row(f"held by {cause}", 0, story.end, pieces) for cause, pieces in held.items()]
    faults = fault_spans(story)
    parts += [_row(f"fault {name}", 0, story.end, pieces) for name, pieces in faults.items()]
    return "".join([*parts, _axis(story.end), _legend(story, faults=bool(faults))])


def fault_spans(story: Story) -> dict[str, list[Piece]]:
    """When each declared fault of the simulation was there, by its name."""
    found = defaultdict[str, list[Piece]](list)
    for event in story.events:
        name = event.fields.get("fault")
        if event.kind == "fault":
            end = story.end if event.fields.get("lasts") else event.time
            found[str(name)].append((event.time, end, "bad", "fault"))
        elif event.kind == "fault_end" and found[str(name)]:
            begin, _, *rest = found[str(name)][-1]
            found[str(name)][-1] = (begin, event.time, rest[0], rest[1])
    return dict(found)


def _row(name: str, depth: int, end: float, pieces: Iterable[Piece]) -> str:
    words, across = escape(printable(name)), SPAN / max(end, 1e-9)
    bars = "".join(
        f'<rect x="{begin * across:.1f}" y="0" height="10" class="{colour}" '
        f'width="{max(LEAST_BAR, (last - begin) * across):.1f}">'
        f"<title>{words}: {outcome}, {begin:.1f} to {last:.1f} s</title></rect>"
        for begin, last, colour, outcome in pieces
    )
    return (
        f'<div class="row"><span class="label" style="padding-left: {min(depth, 8) * 9}px" '
        f'title="{words}">{words}</span><svg viewBox="0 0 {SPAN:.0f} 10" '
        f'preserveAspectRatio="none" role="img" aria-label="{words}">{bars}</svg></div>'
    )


def _axis(end: float) -> str:
    ticks = "".join(
        f'<span style="left: {100 * time / max(end, 1e-9):.1f}%">{time:g} s</span>'
        for time in time_steps(end)
    )
    return f'<div class="row"><span></span><div class="ticks">{ticks}</div></div>'


def _legend(story: Story, *, faults: bool) -> str:
    """The colours that this timeline has."""
    found = {bar.outcome for _, _, bars in story.bars for bar in bars}
    colours = [(OUTCOMES[word], word) for word in OUTCOMES if word in found]
    effects = {hold.effect for hold in story.holds}
    colours += [(effect, effect) for effect in (STOPPED, SLOWER) if effect in effects]
    colours += [("bad", "fault")] if faults else []
    keys = "".join(
        f'<span class="key"><svg viewBox="0 0 12 12" width="12" height="12">'
        f'<rect y="2" width="12" height="8" class="{colour}"/></svg> {word}</span>'
        for colour, word in colours
    )
    return f"<figcaption>{keys}</figcaption>"
