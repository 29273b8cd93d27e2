"""A small line chart in braille."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray
from rich.segment import Segment
from textual.strip import Strip
from textual.widget import Widget

from stack.types import FloatArray
from tui import palette
from tui.canvas import BRAILLE
from tui.strips import style, to_strips

SPAN = 60.0
"""Seconds of the robot's clock from the left edge to the right."""

TICKS = 6
"""Characters of the vertical scale."""


class Chart(Widget):
    """The last minute of a few values, newest at the right."""

    def __init__(
        self, title: str, unit: str, series: dict[str, int], floor: float, top: float
    ) -> None:
        """A chart without values.

        Args:
            title: what is measured.
            unit: of the values.
            series: colour of each value by name; later ones are drawn over earlier ones.
            floor: the scale reaches at least down to here,
            top: and at least up to here.
        """
        super().__init__(classes="chart")
        self.border_title = f"{title} [dim]{unit}[/]"
        self._colours, self._floor, self._top = series, floor, top
        self._times: deque[float] = deque(maxlen=2400)
        self._values = {name: deque[float](maxlen=2400) for name in series}
        self._strips: list[Strip] = []

    def add(self, time: float, **values: float) -> None:
        """One more sample of every series, at a robot time; a second one of a time is ignored."""
        if self._times and time <= self._times[-1]:
            return
        self._times.append(time)
        for name, value in values.items():
            self._values[name].append(value)
        while self._times[0] < time - SPAN:
            self._times.popleft()
            for samples in self._values.values():
                samples.popleft()
        self.border_subtitle = "  ".join(
            f"[{palette.css(self._colours[name])}]━[/] {name} {value:.2f}"
            for name, value in values.items()
        )
        self._redraw()

    def on_resize(self) -> None:
        """Draw at the new size."""
        self._redraw()

    def render_line(self, y: int) -> Strip:
        """One line of the chart."""
        return self._strips[y] if y < len(self._strips) else Strip.blank(self.size.width)

    def _redraw(self) -> None:
        columns, rows = self.size.width - TICKS - 1, self.size.height
        self.refresh()
        if columns < 4 or rows < 1:
            self._strips = []
            return
        known = [value for values in self._values.values() for value in values]
        low, high = min([self._floor, *known]), max([self._top, *known])
        glyphs = np.full((rows, columns), 0x2800, dtype=np.uint32)
        colours = np.full((rows, columns), palette.DIM, dtype=np.uint32)
        for name, values in self._values.items():
            if self._times:
                levels = sample(np.array(self._times), np.array(values), columns * 2)
                draw_curve(glyphs, colours, (levels - low) / (high - low), self._colours[name])
        body = to_strips(glyphs, colours, np.full_like(colours, palette.BACKDROP))
        self._strips = [
            Strip(
                [
                    Segment(_tick(row, rows, low, high), style(palette.IDLE, palette.BACKDROP)),
                    *strip,
                ]
            )
            for row, strip in enumerate(body)
        ]


def sample(times: FloatArray, values: FloatArray, columns: int) -> FloatArray:
    """(columns,) values, one a dot column, over the last SPAN seconds; NaN before the first."""
    at = times[-1] - SPAN * (1.0 - np.arange(1, columns + 1) / columns)
    levels: FloatArray = np.interp(at, times, values, left=np.nan)
    return levels


def draw_curve(
    glyphs: NDArray[np.uint32], colours: NDArray[np.uint32], shares: FloatArray, colour: int
) -> None:
    """Draw shares of the height (2 × columns,) as one unbroken curve of braille dots."""
    rows = glyphs.shape[0] * 4
    column = np.flatnonzero(np.isfinite(shares))
    row = np.clip(((1.0 - shares[column]) * (rows - 1)).round().astype(int), 0, rows - 1)
    before = np.concatenate([row[:1], row[:-1]])
    # From just beyond the last dot to this one, so that steep pieces hang together.
    first = np.where(row > before, before + 1, row)
    last = np.where(row < before, before - 1, row)
    counts = last - first + 1
    column = np.repeat(column, counts)
    row = (
        np.repeat(first, counts)
        + np.arange(counts.sum())
        - np.repeat(np.cumsum(counts) - counts, counts)
    )
    cells = (row // 4, column // 2)
    np.bitwise_or.at(glyphs, cells, BRAILLE[row % 4, column % 2])
    colours[cells] = colour


def _tick(row: int, rows: int, low: float, high: float) -> str:
    if row == 0:
        return f"{high:{TICKS - 1}.2f} ┤"
    return f"{low:{TICKS - 1}.2f} ┤" if row == rows - 1 else " " * TICKS + "│"
