"""A small line chart in braille."""

from __future__ import annotations

from collections import deque

import numpy as np
from rich.segment import Segment
from textual.strip import Strip
from textual.widget import Widget

from tui import palette
from tui.canvas import BRAILLE
from tui.strips import ink, to_strips


class Chart(Widget):
    """The last minute or so of a few values, newest at the right."""

    def __init__(
        self, title: str, unit: str, series: dict[str, int], floor: float, top: float
    ) -> None:
        super().__init__(classes="chart")
        self.border_title = title
        self._unit, self._colours = unit, series
        self._floor, self._top = floor, top
        self._values = {name: deque[float](maxlen=400) for name in series}
        self._strips: list[Strip] = []

    def add(self, **values: float) -> None:
        """One more sample of each series."""
        for name, value in values.items():
            self._values[name].append(value)
        last = "  ".join(
            f"[{palette.css(self._colours[name])}]━[/] {name} {value:.2f}"
            for name, value in values.items()
        )
        self.border_subtitle = f"{last} {self._unit}".strip()
        self._redraw()
        self.refresh()

    def on_resize(self) -> None:
        """Draw at the new size."""
        self._redraw()

    def render_line(self, y: int) -> Strip:
        """One line of the chart."""
        return self._strips[y] if y < len(self._strips) else Strip.blank(self.size.width)

    def _redraw(self) -> None:
        width, rows = self.size.width, self.size.height
        columns = width - 6
        if columns < 4 or rows < 1:
            self._strips = []
            return
        known = [value for values in self._values.values() for value in values]
        low, high = min([self._floor, *known]), max([self._top, *known])
        glyphs = np.full((rows, columns), 0x2800, dtype=np.uint32)
        colours = np.full((rows, columns), palette.DIM, dtype=np.uint32)
        for name, values in self._values.items():
            recent = np.array(values)[-columns * 2 :]
            if not len(recent):
                continue
            column = np.arange(columns * 2 - len(recent), columns * 2)
            share = (recent - low) / max(high - low, 1e-9)
            row = np.clip(((1.0 - share) * (rows * 4 - 1)).round().astype(int), 0, rows * 4 - 1)
            np.bitwise_or.at(glyphs, (row // 4, column // 2), BRAILLE[row % 4, column % 2])
            colours[row // 4, column // 2] = self._colours[name]
        back = np.full_like(colours, 0x0B111C)
        body = to_strips(glyphs, colours, back)
        self._strips = [
            Strip([Segment(self._tick(row, rows, low, high), ink(palette.FAINT)), *strip])
            for row, strip in enumerate(body)
        ]

    def _tick(self, row: int, rows: int, low: float, high: float) -> str:
        if row == 0:
            return f"{high:5.2f} "
        return f"{low:5.2f} " if row == rows - 1 else " " * 6
