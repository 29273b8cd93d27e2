"""Figures of a report as SVG: map with the driven way, timeline of the tree, plots over time."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from html import escape
from itertools import groupby
from math import ceil, isfinite

import numpy as np

from missions.inspection.page.story import Samples, Story
from stack.types import FloatArray, OccupancyGrid

WIDTH = 720
"""Of a figure, in its own units; it is scaled to the page."""

PLOT_WIDTH = 480
"""Of a plot: several stand side by side."""

LEFT, RIGHT, TOP = 46, 8, 26
"""Margins of what has a scale."""

ROW = 17
"""Height of a row of the timeline."""

MOST_ROWS = 60
"""Rows of the timeline; deeper nodes are left out first."""

LEAST_APART = 0.3
"""The true way is drawn if it is anywhere farther from the estimate than this, metres."""

RUN_COLOURS = ("var(--run1)", "var(--run2)", "var(--run3)", "var(--run4)")
OUTCOMES = {"success": "good", "failure": "bad", "idle": "idle", "running": "busy"}


def text(x: float, y: float, words: str, kind: str = "", anchor: str = "start") -> str:
    """A text."""
    place = f'x="{x:.1f}" y="{y:.1f}" class="{kind}" text-anchor="{anchor}"'
    return f"<text {place}>{escape(words)}</text>"


def svg(width: float, height: float, parts: Iterable[str], label: str) -> str:
    """A figure that takes the width of the page."""
    return (
        f'<svg viewBox="0 0 {width:.0f} {height:.0f}" role="img" aria-label="{escape(label)}">'
        + "".join(parts)
        + "</svg>"
    )


def map_figure(story: Story) -> str:
    """The map with the driven way: coloured by speed, with a ring where the robot was held."""
    samples, grid = story.samples, story.grid
    view = _View(grid, samples)
    parts = [] if grid is None else [view.picture(grid)]
    top = max(0.2, float(np.nanmax(samples.speed, initial=0.0)))
    x, y = view.pixels(samples.x, samples.y)
    for first, last, level in _stretches(samples.speed / top, x, y):
        points = _points(x[first:last], y[first:last])
        parts.append(f'<polyline class="speed{level}" points="{points}"/>')
    true_way = bool((samples.error > LEAST_APART).any())
    if true_way:
        parts += _true_way(samples, view)
    parts += _held_marks(samples, x, y)
    parts += _moved_marks(story, view)
    parts += [f'<circle cx="{x[0]:.1f}" cy="{y[0]:.1f}" r="6" class="begin"/>',
              f'<circle cx="{x[-1]:.1f}" cy="{y[-1]:.1f}" r="6" class="end"/>']  # fmt: skip
    for name, at in story.places.items():
        a, b = view.pixel(*at)
        parts += [f'<circle cx="{a:.1f}" cy="{b:.1f}" r="3" class="place"/>',
                  text(a + 9, b - 9, name, "small")]  # fmt: skip
    for failing in story.failures:
        for time in failing.times:
            number = int(np.searchsorted(samples.time, time).clip(0, len(x) - 1))
            why = escape(f"{time:.1f} s: {failing.name} failed: {failing.message}")
            mark = text(float(x[number]), float(y[number]) + 5, "✘", "mark", "middle")
            parts.append(f"<g><title>{why}</title>{mark}</g>")
    legend = [
        ("speed0", "slow"), ("speed4", f"{top:.1f} m/s"), ("heldmark", "held"),
    ]  # fmt: skip
    if true_way:
        legend.append(("truth", "true way"))
    for number, (kind, word) in enumerate(legend):
        left = 8 + 90 * number
        parts += [f'<line x1="{left}" y1="{view.height + 12}" x2="{left + 18}" '
                  f'y2="{view.height + 12}" class="{kind}"/>',
                  text(left + 24, view.height + 16, word, "small")]  # fmt: skip
    parts.append(
        text(WIDTH - 8, view.height + 16, "○ start  ● end  ✘ a node failed", "small", "end")
    )
    return svg(WIDTH, view.height + 24, parts, f"map of {story.name} with the driven way")


class _View:
    """Scale of a map figure: metres to its units, north up."""

    def __init__(self, grid: OccupancyGrid | None, samples: Samples) -> None:
        x = np.concatenate([samples.x, samples.true_x])
        y = np.concatenate([samples.y, samples.true_y])
        low = np.array([np.nanmin(x), np.nanmin(y)]) - 1.0
        high = np.array([np.nanmax(x), np.nanmax(y)]) + 1.0
        if grid is not None:
            rows, columns = np.nonzero(grid.cells >= 0)
            if len(rows):
                origin = np.array(grid.origin)
                known = np.array([columns.min(), rows.min()]), np.array([columns.max(), rows.max()])
                low = np.minimum(low, origin + known[0] * grid.resolution)
                high = np.maximum(high, origin + (known[1] + 1) * grid.resolution)
        self.low, self.high = low, high
        size = high - low
        self.scale = min(WIDTH / size[0], 0.9 * WIDTH / size[1])
        self.left = 0.5 * (WIDTH - size[0] * self.scale)
        self.height = float(size[1] * self.scale)

    def pixel(self, x: float, y: float) -> tuple[float, float]:
        """Place in the figure of a place on the map."""
        return self.left + (x - self.low[0]) * self.scale, (self.high[1] - y) * self.scale

    def pixels(self, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Places in the figure of places on the map."""
        return self.left + (x - self.low[0]) * self.scale, (self.high[1] - y) * self.scale

    def picture(self, grid: OccupancyGrid) -> str:
        """The map as a picture that suits light and dark pages."""
        import cv2

        cells = grid.cells
        pixels = np.zeros((*cells.shape, 4), np.uint8)
        pixels[grid.free] = (128, 128, 128, 28)
        pixels[grid.occupied] = (130, 120, 110, 255)
        done, encoded = cv2.imencode(".png", np.flipud(pixels))
        if not done:
            return ""
        height, width = cells.shape
        top = grid.origin[1] + height * grid.resolution
        x, y = self.pixel(grid.origin[0], top)
        code = base64.b64encode(encoded.tobytes()).decode()
        return (
            f'<image x="{x:.1f}" y="{y:.1f}" width="{width * grid.resolution * self.scale:.1f}" '
            f'height="{height * grid.resolution * self.scale:.1f}" '
            f'preserveAspectRatio="none" href="data:image/png;base64,{code}"/>'
        )


def _stretches(shares: FloatArray, x: FloatArray, y: FloatArray) -> list[tuple[int, int, int]]:
    """First and last sample, and level 0 to 4, of each stretch of about the same speed.

    A jump of the pose is not drawn as a way.
    """
    levels = np.clip((shares * 5).astype(int), 0, 4)
    steps = np.hypot(np.diff(x), np.diff(y))
    usual = float(np.median(steps[steps > 0])) if (steps > 0).any() else 1.0
    jumps = np.concatenate([[False], steps > max(40.0, 12 * usual)])
    found, first = [], 0
    for at in range(1, len(levels) + 1):
        if at == len(levels) or levels[at] != levels[first] or jumps[at]:
            last = at if at == len(levels) or jumps[at] else at + 1
            if last - first > 1:
                found.append((first, last, int(levels[first])))
            first = at
    return found


def _true_way(samples: Samples, view: _View) -> list[str]:
    """The way that the robot really took."""
    known = np.isfinite(samples.true_x)
    x, y = view.pixels(samples.true_x[known], samples.true_y[known])
    return [
        f'<polyline class="truth" points="{_points(x[first:last], y[first:last])}"/>'
        for first, last, _ in _stretches(np.zeros(len(x)), x, y)
    ]


def _points(x: FloatArray, y: FloatArray) -> str:
    return " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))


def _moved_marks(story: Story, view: _View) -> list[str]:
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
        label = text(a + 10, b + 14, f"{event.kind} {event.time:.1f} s", "small")
        parts.append(
            f'<g><title>{escape(words)}</title><path d="M{a:.1f} {b - 7:.1f}l7 7l-7 7l-7 -7z" '
            f'class="moved"/>{label}</g>'
        )
    return parts


def _held_marks(samples: Samples, x: FloatArray, y: FloatArray) -> list[str]:
    """A circle where the robot stood for something: the longer, the larger."""
    parts = []
    for first, last, cause in held_spans(samples):
        seconds = samples.time[min(last, len(x) - 1)] - samples.time[first]
        parts.append(
            f'<circle cx="{x[first]:.1f}" cy="{y[first]:.1f}" r="{4 + min(10.0, seconds):.1f}" '
            f'class="heldmark"><title>{samples.time[first]:.1f} s: held by {escape(cause)} for '
            f"{seconds:.1f} s</title></circle>"
        )
    return parts


def held_spans(samples: Samples) -> list[tuple[int, int, str]]:
    """First sample, sample after the last, and cause of each time in which the robot stood."""
    spans, at = [], 0
    keys = zip(samples.held, samples.stands, strict=True)
    for (cause, stands), group in groupby(keys):
        count = len(list(group))
        if stands and cause:
            spans.append((at, at + count, cause))
        at += count
    return spans


def timeline(story: Story) -> str:
    """When each node of the tree ran, and how it ended."""
    rows = story.bars
    deepest = max((depth for depth, *_ in rows), default=0)
    while len(rows) > MOST_ROWS and deepest > 1:
        rows = [row for row in rows if row[0] < deepest]
        deepest -= 1
    rows = rows[:MOST_ROWS]
    label_width, height = 230, ROW * (len(rows) + 1) + 24
    across = (WIDTH - label_width - RIGHT) / max(story.end, 1e-9)
    parts = []
    for number, (depth, node, bars) in enumerate(rows):
        y = ROW * number
        name = node.name if len(node.name) < 34 - 2 * depth else node.name[: 32 - 2 * depth] + "…"
        parts.append(text(4 + 9 * depth, y + 12, name, "small"))
        for bar in bars:
            width = max(1.5, (bar.end - bar.begin) * across)
            seconds = f"{bar.begin:.1f} to {bar.end:.1f} s"
            parts.append(
                f'<rect x="{label_width + bar.begin * across:.1f}" y="{y + 2}" width="{width:.1f}" '
                f'height="{ROW - 5}" class="{OUTCOMES.get(bar.outcome, "busy")}">'
                f"<title>{escape(node.name)}: {bar.outcome}, {seconds}</title></rect>"
            )
    y = ROW * len(rows)
    parts.append(text(4, y + 12, "held", "small"))
    for first, last, cause in held_spans(story.samples):
        time = story.samples.time
        begin, end = time[first], time[min(last, len(time) - 1)]
        parts.append(
            f'<rect x="{label_width + begin * across:.1f}" y="{y + 2}" height="{ROW - 5}" '
            f'width="{max(2.0, (end - begin) * across):.1f}" class="held">'
            f"<title>held by {escape(cause)}, {begin:.1f} to {end:.1f} s</title></rect>"
        )
    parts += _time_axis(label_width, WIDTH - RIGHT, story.end, y + ROW)
    return svg(WIDTH, height, parts, f"timeline of {story.name}")


def plot(  # noqa: PLR0913 - the optional ones by keyword
    title: str, unit: str, series: Sequence[tuple[str, FloatArray, FloatArray, str]],
    end: float, *, least_top: float = 0.0, height: int = 120,
) -> str:  # fmt: skip
    """Values over time.

    Args:
        title: measured quantity.
        unit: of the values.
        series: name, times, values and colour of each curve.
        end: of the time scale, seconds.
        least_top: the scale ends at no lower value.
        height: of the figure.
    """
    known = [value for _, _, values, _ in series for value in values if isfinite(value)]
    if not known:
        return ""
    highest = max([least_top, *known]) or 1.0
    step = _round_step(highest / 5)
    top = step * ceil(highest / step - 1e-9)
    bottom_line, across = height - 22, (PLOT_WIDTH - LEFT - RIGHT) / max(end, 1e-9)
    parts = [f'<line x1="{LEFT}" y1="{TOP}" x2="{LEFT}" y2="{bottom_line}" class="axis"/>',
             text(LEFT - 4, TOP + 4, f"{top:.3g}", "tick", "end"),
             text(LEFT - 4, bottom_line, "0", "tick", "end"),
             text(4, 12, f"{title}, {unit}" if unit else title, "name")]  # fmt: skip
    for number, (name, times, values, colour) in enumerate(series):
        y = bottom_line - np.clip(values / top, 0.0, 1.0) * (bottom_line - TOP)
        parts.append(_curve(LEFT + times * across, y, colour))
        if name:
            parts.append(
                f'<text x="{PLOT_WIDTH - 8 - 110 * number}" y="12" text-anchor="end" class="small" '
                f'style="fill:{colour}">{escape(name)}</text>'
            )
    parts += _time_axis(LEFT, PLOT_WIDTH - RIGHT, end, bottom_line)
    return svg(PLOT_WIDTH, height, parts, title)


def _curve(x: FloatArray, y: FloatArray, colour: str) -> str:
    """A curve with gaps where a value is missing."""
    runs, pieces = np.isfinite(y), []
    begins = True
    for a, b, known in zip(x, y, runs, strict=True):
        if known:
            pieces.append(f"{'M' if begins else 'L'}{a:.1f} {b:.1f}")
        begins = not known
    return f'<path d="{"".join(pieces)}" class="curve" style="stroke:{colour}"/>'


def _time_axis(left: float, right: float, end: float, y: float) -> list[str]:
    step = _round_step(end / 6)
    parts = [f'<line x1="{left}" y1="{y}" x2="{right}" y2="{y}" class="axis"/>']
    for number in range(ceil(end / step) + 1):
        time = number * step
        if time <= end + 1e-9:
            x = left + (right - left) * time / max(end, 1e-9)
            parts += [f'<line x1="{x:.1f}" y1="{y}" x2="{x:.1f}" y2="{y + 4}" class="axis"/>',
                      text(x, y + 15, f"{time:g} s", "tick",
                           "end" if x > right - 14 else "middle")]  # fmt: skip
    return parts


def _round_step(step: float) -> float:
    """The next of 1, 2, 5 times a power of ten."""
    power = 10.0 ** np.floor(np.log10(max(step, 1e-3)))
    return float(next(factor * power for factor in (1, 2, 5, 10) if factor * power >= step - 1e-9))
