"""The map of a report: the driven way, what held and blocked the robot, and where nodes failed."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape

import numpy as np
from numpy.typing import NDArray

from missions.inspection.page.blockers import Blocker
from missions.inspection.page.map_view import WIDTH, MapView
from missions.inspection.page.story import Samples, Story
from stack.telemetry.records import AROUND_ARM
from stack.types import FloatArray
from stack.types.limitations import STOPPED

LEAST_APART = 0.3
"""The true way is drawn if it is anywhere farther from the estimate than this, metres."""

STOOD = 0.1
"""A robot whose true way is nowhere farther apart than this has stood, metres."""

LEAST_RADIUS = 6.0
"""Of a person, in units of the figure."""

LEVELS = 5
"""Colours of speed."""


def map_figure(story: Story) -> str:
    """The map with the driven way: coloured by speed, with a ring where the robot was held."""
    samples, grid = story.samples, story.grid
    if not story.drives:
        grid = None  # what the arm knows is drawn instead
    view = MapView(
        grid, np.concatenate([samples.x, samples.true_x]),
        np.concatenate([samples.y, samples.true_y]),
    )  # fmt: skip
    top = max(0.2, float(np.nanmax(samples.speed, initial=0.0)))
    x, y = view.pixels(samples.x, samples.y)
    parts = [] if grid is None else [view.picture(grid)]
    jumps = _jumps(x, y) if story.drives else np.zeros(len(x), bool)
    for number in np.flatnonzero(jumps):
        points = _points(x[number - 1 : number + 1], y[number - 1 : number + 1])
        parts.append(f'<polyline class="jump" points="{points}"/>')
    for first, last, level in _stretches(samples.speed / top, jumps):
        points = _points(x[first:last], y[first:last])
        parts.append(f'<polyline class="speed{level}" points="{points}"/>')
    if (samples.error > LEAST_APART).any():
        parts += _true_way(samples, view)
    parts += _held_marks(story, x, y)
    parts += _moved_marks(story, view)
    parts.append(f'<circle cx="{x[0]:.1f}" cy="{y[0]:.1f}" r="6" class="begin"/>')
    if story.failed is None:  # else its cross is the end
        parts.append(f'<circle cx="{x[-1]:.1f}" cy="{y[-1]:.1f}" r="6" class="end"/>')
    parts += _blocks(story, view)
    for name, at in story.places.items() if story.drives else ():
        a, b = view.pixel(*at)
        parts += [f'<circle cx="{a:.1f}" cy="{b:.1f}" r="3" class="place"/>',
                  _label(a, b - 9, [name])]  # fmt: skip
    for blocker in story.blockers:
        parts += _blocker_marks(blocker, view)
    parts += _failure_marks(story, x, y)
    drawn = "".join(parts)
    what = "driven way" if story.drives else "way of the tool"
    label = escape(f"map of {story.name} with the {what}")
    return (
        f'<svg viewBox="0 0 {WIDTH} {view.height:.0f}" role="img" aria-label="{label}">{drawn}'
        f"</svg><figcaption>{''.join(_legend(story, drawn, top))}</figcaption>"
    )


KEYS = (
    ("jump", '<line x1="0" y1="6" x2="24" y2="6" class="jump"/>', "jump of the estimate", 24),
    ("truth", '<line x1="0" y1="6" x2="24" y2="6" class="truth"/>', "true way", 24),
    ("stood", '<circle cx="6" cy="6" r="5" class="stood"/>', "truly stood here", 12),
    ("begin", '<circle cx="6" cy="6" r="4.5" class="begin"/>', "start", 12),
    ("end", '<circle cx="6" cy="6" r="4.5" class="end"/>', "end", 12),
    ("moved", '<path d="M6 0l6 6l-6 6l-6 -6z" class="moved"/>', "lifted or pushed", 12),
    ("shut", '<line x1="0" y1="6" x2="12" y2="6" class="shut"/>', "closed door that blocked", 12),
    ("person", '<circle cx="6" cy="6" r="5" class="person"/>', "person who blocked", 12),
)  # fmt: skip
"""Class of a mark, its drawing in the legend, what it means, and the width of the drawing."""


def _legend(story: Story, drawn: str, top: float) -> Iterator[str]:
    """What the lines and marks that are drawn mean."""
    step = 6
    lines = "".join(
        f'<line x1="{step * level}" y1="6" x2="{step * level + step}" y2="6" class="speed{level}"/>'
        for level in range(LEVELS)
    )
    words = f"0 to {top:.1f} m/s" + ("" if story.drives else ", the tool from above")
    yield _key(lines, words, step * LEVELS)
    for name, drawing, meaning, width in KEYS:
        if f'class="{name}"' in drawn:
            yield _key(drawing, meaning, width)
    causes = dict.fromkeys(hold.cause for hold in story.holds if hold.effect == STOPPED)
    if causes:
        yield _key(
            '<circle cx="6" cy="6" r="4.5" class="heldmark"/>', f"stopped by {', '.join(causes)}"
        )
    if story.failures.every:
        ends = "; the last ended the mission" if story.failed is not None else ""
        yield f'<span class="key"><b class="failed">✘</b> a node failed{ends}</span>'


def _key(drawing: str, words: str, width: int = 12) -> str:
    return (
        f'<span class="key"><svg viewBox="0 0 {width} 12" width="{width}" height="12">{drawing}'
        f"</svg> {escape(words)}</span>"
    )


def _label(x: float, y: float, lines: list[str], kind: str = "small") -> str:
    """Lines of text beside a mark; to its left where the right would be outside the map."""
    beside, anchor = (x - 9, "end") if x > 0.75 * WIDTH else (x + 9, "start")
    spans = "".join(
        f'<tspan x="{beside:.1f}" dy="{1.15 if number else 0}em">{escape(line)}</tspan>'
        for number, line in enumerate(lines)
    )
    return (
        f'<text x="{beside:.1f}" y="{y:.1f}" class="{kind}" text-anchor="{anchor}">{spans}</text>'
    )


def _jumps(x: FloatArray, y: FloatArray) -> NDArray[np.bool_]:
    """Whether the pose jumped to each sample; the arguments are in units of the figure."""
    steps = np.hypot(np.diff(x), np.diff(y))
    usual = float(np.median(steps[steps > 0])) if (steps > 0).any() else 1.0
    return np.append(False, steps > max(40.0, 12 * usual))


def _stretches(shares: FloatArray, jumps: NDArray[np.bool_]) -> list[tuple[int, int, int]]:
    """First and last sample, and level 0 to 4, of each stretch of about the same speed.

    Jumps of the pose are not drawn as a way.
    """
    levels = np.clip((shares * 5).astype(int), 0, 4)
    found, first = [], 0
    for at in range(1, len(levels) + 1):
        if at == len(levels) or levels[at] != levels[first] or jumps[at]:
            last = at if at == len(levels) or jumps[at] else at + 1
            if last - first > 1:
                found.append((first, last, int(levels[first])))
            first = at
    return found


def _blocks(story: Story, view: MapView) -> list[str]:
    """Outlines of the boxes and blocks that an arm knew at the end."""
    layer = story.last.layers.get(AROUND_ARM)
    content = layer.content if layer is not None else ()
    found = []
    for shape in content if isinstance(content, tuple) else ():
        length, width, _ = shape.size
        half = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * (length / 2.0, width / 2.0)
        corners = shape.pose.transform(half)
        colour = ", ".join(str(round(255 * part)) for part in shape.colour)
        points = _points(*view.pixels(corners[:, 0], corners[:, 1]))
        found.append(f'<polygon points="{points}" class="block" style="stroke: rgb({colour})"/>')
    return found


def _true_way(samples: Samples, view: MapView) -> list[str]:
    """The way that the robot really took; a circle if it went nowhere."""
    known = np.isfinite(samples.true_x)
    x, y = view.pixels(samples.true_x[known], samples.true_y[known])
    if np.hypot(np.ptp(x), np.ptp(y)) < STOOD * view.scale:
        return [f'<circle cx="{x[0]:.1f}" cy="{y[0]:.1f}" r="9" class="stood"/>']
    return [
        f'<polyline class="truth" points="{_points(x[first:last], y[first:last])}"/>'
        for first, last, _ in _stretches(np.zeros(len(x)), _jumps(x, y))
    ]


def _points(x: FloatArray, y: FloatArray) -> str:
    return " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))


def _moved_marks(story: Story, view: MapView) -> list[str]:
    """Where the robot was when it was lifted or pushed; just before, in truth if it is known."""
    parts, samples = [], story.samples
    for event in story.events:
        if event.kind not in ("lifted", "pushed"):
            continue
        number = max(0, int(np.searchsorted(samples.time, event.time)) - 1)
        known = np.isfinite(samples.true_x[number])
        at = (samples.true_x, samples.true_y) if known else (samples.x, samples.y)
        a, b = view.pixel(float(at[0][number]), float(at[1][number]))
        words = f"{event.time:.1f} s: {event.text}"
        label = _label(a, b + 22, [f"{event.kind} at {event.time:.1f} s"])
        parts.append(
            f'<g><title>{escape(words)}</title><path d="M{a:.1f} {b - 7:.1f}l7 7l-7 7l-7 -7z" '
            f'class="moved"/>{label}</g>'
        )
    return parts


def _held_marks(story: Story, x: FloatArray, y: FloatArray) -> list[str]:
    """A circle where the robot was stopped by something: the longer, the larger."""
    parts = []
    for hold in story.holds:
        if hold.effect == STOPPED:
            at = _sample_at(story, hold.begin)
            seconds = hold.end - hold.begin
            parts.append(
                f'<circle cx="{x[at]:.1f}" cy="{y[at]:.1f}" r="{4 + min(10.0, seconds):.1f}" '
                f'class="heldmark"><title>{hold.begin:.1f} s: stopped by {escape(hold.cause)} for '
                f"{seconds:.1f} s</title></circle>"
            )
    return parts


def _sample_at(story: Story, time: float) -> int:
    """Number of the first sample from a time on."""
    samples = story.samples.time
    return int(np.searchsorted(samples, time).clip(0, len(samples) - 1))


def _blocker_marks(blocker: Blocker, view: MapView) -> list[str]:
    """A closed door as the line that it is, a person as a disc; with name and time."""
    x, y = view.pixel(*blocker.at)
    if blocker.door is None:
        radius = max(LEAST_RADIUS, blocker.radius * view.scale)
        mark = f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius:.1f}" class="person"/>'
        return [mark, _label(x, y + radius + 12, blocker.label, "small blocker")]
    (x1, y1), (x2, y2) = view.pixel(*blocker.door.start), view.pixel(*blocker.door.end)
    line = f'<line x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}" class="shut"/>'
    x, y = max((x1, y1), (x2, y2), key=lambda end: end[1])
    return [line, _label(x, y - 18, blocker.label, "small blocker")]


def _failure_marks(story: Story, x: FloatArray, y: FloatArray) -> Iterator[str]:
    for failed in story.failures.every:
        number = _sample_at(story, failed.time)
        why = escape(f"{failed.time:.1f} s: {failed.name} failed: {failed.message}")
        yield (
            f'<g><title>{why}</title><text x="{x[number]:.1f}" y="{y[number] + 5:.1f}" '
            'class="mark" text-anchor="middle">✘</text></g>'
        )
