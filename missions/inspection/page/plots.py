"""Plots over time of a report."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from math import ceil, isfinite

import numpy as np

from missions.inspection.page.scales import round_step, time_steps
from stack.types import FloatArray

WIDTH, HEIGHT = 400, 104
"""Of a plot, in its own units; several stand side by side, each as wide on the page."""

LEFT, RIGHT, TOP, BOTTOM = 40, 10, 10, 24
"""Margins of the curves."""


def plot(
    title: str, unit: str, series: Sequence[tuple[str, FloatArray, FloatArray, str]],
    end: float, *, least_top: float = 0.0,
) -> str:  # fmt: skip
    """Values over time; empty if none is known.

    Args:
        title: measured quantity.
        unit: of the values.
        series: name, times, values and colour of each curve.
        end: of the time scale, seconds.
        least_top: the scale ends at no lower value.
    """
    series = [one for one in series if np.isfinite(one[2]).any()]
    known = [value for _, _, values, _ in series for value in values if isfinite(value)]
    if not known:
        return ""
    highest = max([least_top, *known]) or 1.0
    step = round_step(highest / 5)
    top = step * ceil(highest / step - 1e-9)
    zero, across = HEIGHT - BOTTOM, (WIDTH - LEFT - RIGHT) / max(end, 1e-9)
    parts = [f'<line x1="{LEFT}" y1="{TOP}" x2="{LEFT}" y2="{zero}" class="axis"/>',
             f'<line x1="{LEFT}" y1="{zero}" x2="{WIDTH - RIGHT}" y2="{zero}" class="axis"/>',
             _tick(LEFT - 5, TOP + 4, f"{top:.3g}", "end"),
             _tick(LEFT - 5, zero, "0", "end")]  # fmt: skip
    for time in time_steps(end):
        x = LEFT + time * across
        anchor = "end" if x > WIDTH - RIGHT - 14 else "middle"
        parts += [f'<line x1="{x:.1f}" y1="{zero}" x2="{x:.1f}" y2="{zero + 4}" class="axis"/>',
                  _tick(x, zero + 18, f"{time:g} s", anchor)]  # fmt: skip
    for _, times, values, colour in series:
        y = zero - np.clip(values / top, 0.0, 1.0) * (zero - TOP)
        parts.append(_curve(LEFT + times * across, y, colour))
    names = "".join(
        f'<span class="key" style="color: {colour}">{escape(name)}</span>'
        for name, _, _, colour in series if name
    )  # fmt: skip
    heading = escape(f"{title}, {unit}" if unit else title)
    return (
        f"<figcaption><b>{heading}</b> {names}</figcaption>"
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{heading}">'
        f"{''.join(parts)}</svg>"
    )


def _tick(x: float, y: float, words: str, anchor: str) -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" class="tick" text-anchor="{anchor}">{words}</text>'


def _curve(x: FloatArray, y: FloatArray, colour: str) -> str:
    """A curve with gaps where a value is missing."""
    runs, pieces = np.isfinite(y), []
    begins = True
    for a, b, known in zip(x, y, runs, strict=True):
        if known:
            pieces.append(f"{'M' if begins else 'L'}{a:.1f} {b:.1f}")
        begins = not known
    return f'<path d="{"".join(pieces)}" class="curve" style="stroke:{colour}"/>'
