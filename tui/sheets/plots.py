"""Plots: any number of the snapshots over the last 10 s to 10 min, several curves in one frame."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from rich.segment import Segment
from rich.text import Text
from textual.app import ComposeResult
from textual.binding import BindingType
from textual.containers import Horizontal
from textual.strip import Strip
from textual.widgets import Input, OptionList
from textual.widgets.option_list import Option

from stack.types import FloatArray
from tui.drawing import palette
from tui.drawing.palette import css
from tui.drawing.strips import Lines, one_line, style, to_strips
from tui.keys import PLOT_KEYS
from tui.panes.chart import SPANS, draw_curve, fitting_span
from tui.sheets.sheet import Sheet, Shown

COLOURS = (
    palette.BUSY, palette.PATH, palette.PERSON, palette.SCAN, palette.PARTICLE, palette.DEPTH,
)  # fmt: skip
"""Of the curves; a seventh has the colour of the first."""

TICKS = 9
"""Width of the vertical scale in characters."""

BETWEEN, WIDE = 12, 100
"""Rows between two values of the scale; columns from which on the scale of time has four parts."""


def scale_of(series: list[FloatArray]) -> tuple[float, float]:
    """Lower and upper end of a scale that fits all values, with a margin of a twentieth."""
    values = np.concatenate([part for part in series if len(part)] or [np.zeros(1)])
    low, high = float(values.min()), float(values.max())
    margin = (high - low) / 20.0 or max(abs(high) / 20.0, 0.05)
    return low - margin, high + margin


class Plot(Lines):
    """Curves in one frame, newest at the right."""

    EMPTY = "enter plots a number of the list"

    def draw(self, curves: dict[str, tuple[FloatArray, FloatArray]], span: float) -> None:
        """Draw curves of times and values by name; the newest time is at the right edge.

        Args:
            curves: times and values by name.
            span: width in seconds; less while the curves are shorter.
        """
        columns, rows = self.size.width - TICKS - 1, self.size.height - 1 - len(curves)
        if not curves or columns < 8 or rows < 2:
            self.put([])
            return
        low, high = scale_of([values for _, values in curves.values()])
        glyphs = np.full((rows, columns), 0x2800, dtype=np.uint32)
        colours = np.full((rows, columns), palette.DIM, dtype=np.uint32)
        newest = max((times[-1] for times, _ in curves.values() if len(times)), default=0.0)
        oldest = min((times[0] for times, _ in curves.values() if len(times)), default=newest)
        span = fitting_span(newest - oldest, span)
        at = newest - span + span * np.arange(1, columns * 2 + 1) / (columns * 2)
        for number, (times, values) in enumerate(curves.values()):
            if len(times):
                levels = np.interp(at, times, values, left=np.nan)
                colour = COLOURS[number % len(COLOURS)]
                draw_curve(glyphs, colours, (levels - low) / (high - low), colour)
        body = to_strips(glyphs, colours, np.full_like(colours, palette.BACKDROP))
        axis = style(palette.IDLE, palette.BACKDROP)
        strips = [
            Strip([Segment(_tick(row, rows, low, high), axis), *strip])
            for row, strip in enumerate(body)
        ]
        strips.append(Strip([Segment(" " * (TICKS + 1) + _times(span, columns), axis)]))
        widest = max(map(len, curves), default=0)
        strips += [self._legend(n, name, widest, curves[name][1]) for n, name in enumerate(curves)]
        self.put(strips)

    def _legend(self, number: int, name: str, widest: int, values: FloatArray) -> Strip:
        ink = style(COLOURS[number % len(COLOURS)], palette.BACKDROP)
        plain = style(palette.TEXT, palette.BACKDROP)
        text = "no value yet"
        if len(values):
            text = f"{values[-1]:<9.3g}{values.min():.3g} to {values.max():.3g}"
        return Strip([Segment(" ━ ", ink), Segment(one_line(f"{name:<{widest}}  {text}"), plain)])


def _tick(row: int, rows: int, low: float, high: float) -> str:
    """The scale at a row: values at both ends, and between them about every BETWEEN rows."""
    parts = max(2, round((rows - 1) / BETWEEN))
    marks = {round(part * (rows - 1) / parts): part / parts for part in range(parts + 1)}
    if row not in marks:
        return " " * TICKS + "│"
    return f"{high + (low - high) * marks[row]:>{TICKS - 1}.3g} ┤"


def _times(span: float, columns: int) -> str:
    """The scale of time: its ends, and times between them in a wide plot."""
    parts = 4 if columns >= WIDE else 1
    line = " " * columns
    for part in range(parts):
        at = columns * part // parts
        line = f"{line[:at]}{f'-{span * (parts - part) / parts:g} s':<{columns - at}}"
    return f"{line[: columns - 3]}now"


def _listed(text: str, colour: int) -> Text:
    return Text(text, style=css(colour), no_wrap=True, overflow="ellipsis")


class PlotSheet(Sheet):
    """A list of all numbers, and the plot of the chosen ones.

    Args:
        chosen: names of the plotted numbers; changed in place, so that they are kept.
    """

    BINDINGS: ClassVar[list[BindingType]] = [key.binding() for key in PLOT_KEYS]

    def __init__(self, chosen: list[str]) -> None:
        super().__init__()
        self._chosen, self._span = chosen, 60.0
        self._shown: Shown | None = None
        self._names: list[str] = []

    def compose(self) -> ComposeResult:
        """Compose filter and list beside the plot."""
        with Horizontal(classes="sheet plots") as sheet:
            sheet.border_title = "Plots"
            yield OptionList(markup=False)
            yield Plot()
        line = Input(placeholder="part of a name; ctrl+space stops the robot", id="plot-filter")
        line.cursor_blink, line.display = False, False
        yield line

    def on_mount(self) -> None:
        """Focus the list."""
        self.query_one(OptionList).focus()
        self._label()

    def fill(self, shown: Shown) -> None:
        """Show the numbers of a snapshot."""
        self._shown = shown
        self._list()
        self._draw()

    def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        """Plot a number, or no longer."""
        name = event.option.id or ""
        if name in self._chosen:
            self._chosen.remove(name)
        else:
            self._chosen.append(name)
        self._names = []
        self._list()
        self._draw()

    def on_input_changed(self) -> None:
        """List the numbers with these words."""
        self._list()

    def on_input_submitted(self) -> None:
        """Return to the list; the filter stays."""
        self.query_one(OptionList).focus()

    def action_filter(self) -> None:
        """Ask for a part of the names."""
        self.query_one(Input).display = True
        self.query_one(Input).focus()

    def action_close(self) -> None:
        """End the filter, or close the sheet."""
        line = self.query_one(Input)
        if not line.display:
            self.dismiss(None)
            return
        line.value, line.display = "", False
        self.query_one(OptionList).focus()

    def action_span(self, steps: int) -> None:
        """Show more or less time."""
        at = SPANS.index(self._span) + steps
        self._span = SPANS[max(0, min(at, len(SPANS) - 1))]
        self._label()
        self._draw()

    def _label(self) -> None:
        hint = f"{self._span:g} s, + - · enter plots · / filters · P or esc closes"
        self.query_one(".sheet").border_subtitle = hint

    def _list(self) -> None:
        if self._shown is None:
            return
        words = self.query_one(Input).value.lower().split()
        names = [
            name for name in self._shown.figures.names if all(w in name.lower() for w in words)
        ]
        if names == self._names:
            return
        rows, self._names = self.query_one(OptionList), names
        before = rows.highlighted
        rows.set_options([Option(self._row(name), id=name) for name in names])
        rows.highlighted = min(before or 0, len(names) - 1) if names else None

    def _row(self, name: str) -> Text:
        if name not in self._chosen:
            return _listed(f"  {one_line(name)}", palette.DIM)
        colour = COLOURS[self._chosen.index(name) % len(COLOURS)]
        return _listed(f"━ {one_line(name)}", colour)

    def _draw(self) -> None:
        if self._shown is not None:
            figures = self._shown.figures
            curves = {name: figures.series(name, self._span) for name in self._chosen}
            self.query_one(Plot).draw(curves, self._span)
