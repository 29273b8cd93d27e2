"""Small line chart in braille dots."""

from __future__ import annotations

from collections import deque
from math import isfinite, nan

import numpy as np
from numpy.typing import NDArray
from rich.segment import Segment
from textual.strip import Strip

from stack.types import FloatArray
from tui.drawing import palette
from tui.drawing.canvas import BRAILLE
from tui.drawing.strips import Lines, style, to_strips

SPAN = 60.0
"""Width of the chart in seconds of the robot's clock, at most."""

SPANS = (10.0, 30.0, SPAN, 120.0, 300.0, 600.0)
"""Widths of charts, seconds."""

TICKS = 6
"""Width of the vertical scale in characters."""


class Chart(Lines):
    """Chart of the last minute of several values, or of less while there is less."""

    def __init__(
        self, title: str, unit: str, series: dict[str, int], floor: float, top: float
    ) -> None:
        """Create an empty chart.

        Args:
            title: measured quantity.
            unit: unit of the values.
            series: name -> colour; later series are drawn over earlier ones.
            floor: highest lower end of the scale.
            top: lowest upper end of the scale.
        """
        super().__init__(classes="chart")
        self._title, self._unit, self._span = title, unit, 0.0
        self._show_span(SPANS[0])
        self._colours, self._floor, self._top = series, floor, top
        self._times: deque[float] = deque(maxlen=2400)
        self._values = {name: deque[float](maxlen=2400) for name in series}
        self._subtitle = ""

    def add(self, time: float, *, draw: bool = True, **values: float) -> None:
        """Add a sample at a robot time; a repeated time is ignored.

        Args:
            time: robot's clock, seconds.
            draw: whether to draw now, or with a later sample.
            values: of the series; those that are left out or NaN are not known.
        """
        if self._times and time <= self._times[-1]:
            return
        self._times.append(time)
        for name, samples in self._values.items():
            samples.append(values.get(name, nan))
        while self._times[0] < time - SPAN:
            self._times.popleft()
            for samples in self._values.values():
                samples.popleft()
        if not draw:
            return
        subtitle = " ".join(
            f"[{palette.css(self._colours[name])}]━[/]{name} {value:.2f}"
            for name, value in values.items()
            if isfinite(value)
        )
        if subtitle != self._subtitle:
            self.border_subtitle = self._subtitle = subtitle
        self._redraw()

    def restart(self) -> None:
        """Forget all samples."""
        self._times.clear()
        for samples in self._values.values():
            samples.clear()

    def on_resize(self) -> None:
        """Redraw at the new size."""
        self._redraw()

    def _show_span(self, span: float) -> None:
        """Set the width in seconds; the title tells it."""
        if span != self._span:
            self._span, dim = span, palette.css(palette.DIM)
            unit = f"{self._unit} · " if self._unit else ""
            self.border_title = f"{self._title} [{dim}]{unit}{span:g} s[/]"

    def _redraw(self) -> None:
        columns, rows = self.size.width - TICKS - 1, self.size.height
        if columns < 4 or rows < 1:
            self.put([])
            return
        if self._times:
            self._show_span(fitting_span(self._times[-1] - self._times[0], SPAN))
        known = [value for values in self._values.values() for value in values if isfinite(value)]
        low, high = min([self._floor, *known]), max([self._top, *known])
        glyphs = np.full((rows, columns), 0x2800, dtype=np.uint32)
        colours = np.full((rows, columns), palette.DIM, dtype=np.uint32)
        for name, values in self._values.items():
            if self._times:
                levels = sample(np.array(self._times), np.array(values), columns * 2, self._span)
                draw_curve(glyphs, colours, (levels - low) / (high - low), self._colours[name])
        body = to_strips(glyphs, colours, np.full_like(colours, palette.BACKDROP))
        axis = style(palette.IDLE, palette.BACKDROP)
        self.put(
            [
                Strip([Segment(_tick(row, rows, low, high), axis), *strip])
                for row, strip in enumerate(body)
            ]
        )


def fitting_span(seconds: float, most: float) -> float:
    """Return the width of a chart of so many seconds: the next of SPANS, `most` at most."""
    return min(most, next((span for span in SPANS if span >= seconds), most))


def sample(times: FloatArray, values: FloatArray, columns: int, span: float) -> FloatArray:
    """Return values (columns,), one per dot column of the last `span` seconds; NaN before data.

    The columns are at multiples of their distance, so that the curve moves by whole dots. The last
    one has the newest value.
    """
    spacing = span / columns
    at = (np.ceil(times[-1] / spacing) - np.arange(columns)[::-1]) * spacing
    levels: FloatArray = np.interp(at, times, values, left=np.nan)
    return levels


def draw_curve(
    glyphs: NDArray[np.uint32], colours: NDArray[np.uint32], shares: FloatArray, colour: int
) -> None:
    """Draw fractions of the height (2 × columns,) as a continuous curve of braille dots."""
    rows = glyphs.shape[0] * 4
    column = np.flatnonzero(np.isfinite(shares))
    row = np.clip(((1.0 - shares[column]) * (rows - 1)).round().astype(int), 0, rows - 1)
    before = np.concatenate([row[:1], row[:-1]])
    # Fill from just after the previous dot, so that steep parts have no gaps.
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
        return f"{high:z{TICKS - 1}.2f} ┤"
    return f"{low:z{TICKS - 1}.2f} ┤" if row == rows - 1 else " " * TICKS + "│"
