"""Charts of the page about a sweep, as SVG."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from math import ceil, floor

import numpy as np

from missions.bench.bench import wilson
from missions.inspection.page.scales import round_step
from missions.sweeps.report.results import Level
from missions.sweeps.row import counted
from stack.types import FloatArray

WIDTH, ROW, LEFT, RIGHT = 400, 24, 130, 62
"""Of a chart of rates, in its own units."""

HEIGHT, MARGIN, FLOOR = 130, 34, 24
"""Of a histogram: height, width left of it, and height below it."""

MOST_BARS = 20


def rates_chart(title: str, levels: Sequence[Level]) -> str:
    """Return the rate of success of each level, with its 95 % interval."""
    rates = [(level, *counted(level.rows)) for level in levels]
    least = min((wilson(good, count)[0] for _, good, count in rates if count), default=0.0)
    low = 0.0 if least < 0.5 else floor(10.0 * least) / 10.0
    across = (WIDTH - LEFT - RIGHT) / (1.0 - low)
    bottom = ROW * len(rates) + 6
    parts = [
        f'<line x1="{LEFT}" y1="{bottom}" x2="{WIDTH - RIGHT}" y2="{bottom}" class="axis"/>',
        _tick(LEFT, bottom + 16, f"{low:.0%}"), _tick(WIDTH - RIGHT, bottom + 16, "100%"),
    ]  # fmt: skip
    for number, (level, good, count) in enumerate(rates):
        y = ROW * number + 15
        parts.append(f'<text x="{LEFT - 8}" y="{y + 4}" class="tick" text-anchor="end">'
                     f"{escape(_short(level.name))}</text>")  # fmt: skip
        if not count:
            continue
        begin, end = (LEFT + (max(rate, low) - low) * across for rate in wilson(good, count))
        x = LEFT + (good / count - low) * across
        words = escape(f"{level.name}: {good} of {count} runs succeeded")
        parts.append(
            f'<g><title>{words}</title><line x1="{begin:.1f}" y1="{y}" x2="{end:.1f}" y2="{y}" '
            f'class="interval"/><circle cx="{x:.1f}" cy="{y}" r="4.5" class="rate"/>'
            f'<text x="{WIDTH - RIGHT + 8}" y="{y + 4}" class="tick">{good}/{count}</text></g>'
        )
    return _chart(title, bottom + 22, parts)


def histogram(title: str, unit: str, good: FloatArray, bad: FloatArray) -> str:
    """Return how often values occur; empty without any.

    Args:
        title: measured quantity.
        unit: of the values.
        good: values of the runs that succeeded.
        bad: of the others.
    """
    values = np.concatenate([good, bad])
    if not len(values):
        return ""
    low, high = float(values.min()), float(values.max())
    step = round_step(max(high - low, 1e-3) / MOST_BARS)
    first = floor(low / step + 1e-9)
    count = max(1, ceil(high / step - first + 1e-9))
    edges = step * (first + np.arange(count + 1))
    edges[0], edges[-1] = min(edges[0], low), max(edges[-1], high)  # the products are rounded
    bars = [np.histogram(part, edges)[0] for part in (good, bad)]
    top, across = int((bars[0] + bars[1]).max()), (WIDTH - MARGIN - 10) / count
    up = (HEIGHT - FLOOR - 8) / top
    parts = []
    for number in range(count):
        y = float(HEIGHT - FLOOR)
        for bar, kind in ((bars[0][number], "good"), (bars[1][number], "bad")):
            height = float(bar) * up
            y -= height
            if bar:
                words = f"{edges[number]:.4g} to {edges[number + 1]:.4g}: {bar} runs"
                parts.append(
                    f'<rect x="{MARGIN + number * across + 0.5:.1f}" y="{y:.1f}" '
                    f'width="{max(across - 1.0, 1.0):.1f}" height="{height:.1f}" class="{kind}">'
                    f"<title>{words}</title></rect>"
                )
    floor_y = HEIGHT - FLOOR
    parts += [
        f'<line x1="{MARGIN}" y1="{floor_y}" x2="{WIDTH - 10}" y2="{floor_y}" class="axis"/>',
        _tick(MARGIN, HEIGHT - 6, f"{edges[0]:.3g}"),
        _tick(WIDTH - 10, HEIGHT - 6, f"{edges[-1]:.3g}", "end"),
        _tick(MARGIN - 6, 14, f"{top}", "end"),
    ]  # fmt: skip
    return _chart(f"{title}, {unit}", HEIGHT, parts)


def _chart(title: str, height: int, parts: Sequence[str]) -> str:
    heading = escape(title)
    return (
        f'<figure class="plot"><figcaption><b>{heading}</b></figcaption>'
        f'<svg viewBox="0 0 {WIDTH} {height}" role="img" aria-label="{heading}">'
        f"{''.join(parts)}</svg></figure>"
    )


def _tick(x: float, y: float, words: str, anchor: str = "middle") -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" class="tick" text-anchor="{anchor}">{words}</text>'


def _short(name: str, most: int = 20) -> str:
    return name if len(name) <= most else f"…{name[-most + 1 :]}"
