"""Conversion of glyph and colour arrays to Textual strips, with cached styles."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from itertools import pairwise
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from rich.segment import Segment
from rich.style import Style
from rich.text import Text
from textual.filter import ANSIToTruecolor, LineFilter
from textual.geometry import Region
from textual.strip import Strip
from textual.widget import Widget

from stack.types.printable import printable
from tui.drawing.palette import BACKDROP, DIM, css


class Lines(Widget):
    """Widget of ready lines; of a new content it refreshes only the lines that differ.

    Attributes:
        EMPTY: sentence in the middle while there are no lines.
    """

    EMPTY: ClassVar[str] = ""
    _strips: list[Strip]

    def __init__(self, id: str | None = None, classes: str | None = None) -> None:
        super().__init__(id=id, classes=classes)
        self._strips = []

    def put(self, strips: list[Strip]) -> None:
        """Show lines; those after the last are empty."""
        before, self._strips = self._strips, strips
        if len(before) != len(strips):
            self.refresh()
            return
        width = self.size.width
        changed = [
            Region(0, y, width, 1)
            for y, (old, new) in enumerate(zip(before, strips, strict=True))
            if old is not new and old != new
        ]
        if changed:
            self.refresh(*changed)

    def render_line(self, y: int) -> Strip:
        """Return one line."""
        if y < len(self._strips):
            return self._strips[y]
        if not self._strips and y == self.size.height // 2:
            return hint(self.EMPTY.center(self.size.width))
        return Strip.blank(self.size.width, paper(BACKDROP))

    def get_line_filters(self) -> Sequence[LineFilter]:
        """Return Textual's filters but the one for ANSI colours, which no line has."""
        return [item for item in super().get_line_filters() if type(item) is not ANSIToTruecolor]


class TextLines(Lines):
    """Lines of text on the background of the style sheet."""

    def put_text(self, text: Text) -> None:
        """Show a text of ready lines; what does not fit is left out, with an ellipsis."""
        width, strips = self.size.width, []
        for line in text.split("\n", allow_blank=True):
            line.truncate(width, overflow="ellipsis", pad=True)
            strips.append(Strip(list(line.render(self.app.console)), width))
        self.put(strips)

    def render_line(self, y: int) -> Strip:
        """Return one line."""
        background = self.background_colors[1].rich_color
        return super().render_line(y).apply_style(Style(bgcolor=background))


def one_line(text: str) -> str:
    """Return a text of a file or another process as one line that is safe to print."""
    return printable(text).replace("\n", " ").replace("\t", " ")


def clock(time: float) -> str:
    """Return a time of the robot's clock, seconds, as minutes and seconds: `01:23.4`."""
    minutes, seconds = divmod(time, 60.0)
    return f"{int(minutes):02d}:{seconds:04.1f}"


@lru_cache(maxsize=4096)
def style(foreground: int, background: int, bold: bool = False) -> Style:
    """Return the style of packed colours."""
    return Style(color=css(foreground), bgcolor=css(background), bold=bold)


@lru_cache(maxsize=512)
def ink(foreground: int, bold: bool = False, italic: bool = False) -> Style:
    """Return a style without a background colour."""
    return Style(color=css(foreground), bold=bold, italic=italic)


def hint(words: str) -> Strip:
    """Return a line that says what an empty pane waits for."""
    return Strip([Segment(words, ink(DIM, italic=True) + paper(BACKDROP))])


@lru_cache(maxsize=32)
def paper(background: int) -> Style:
    """Return a style with a background colour only."""
    return Style(bgcolor=css(background))


def to_strips(
    glyphs: NDArray[np.uint32], foreground: NDArray[np.uint32], background: NDArray[np.uint32]
) -> list[Strip]:
    """Return one strip per row; adjacent cells of equal style form one segment.

    Args:
        glyphs: (rows, columns) code points, each one cell wide.
        foreground: (rows, columns) packed colours.
        background: (rows, columns) packed colours.
    """
    keys = (foreground.astype(np.uint64) << np.uint64(24)) | background.astype(np.uint64)
    strips = []
    for row in range(glyphs.shape[0]):
        edges = np.flatnonzero(np.diff(keys[row])) + 1
        bounds = [0, *edges.tolist(), glyphs.shape[1]]
        text = glyphs[row].astype("<u4").tobytes().decode("utf-32-le")
        segments = [
            Segment(
                text[begin:end], style(int(foreground[row, begin]), int(background[row, begin]))
            )
            for begin, end in pairwise(bounds)
        ]
        strips.append(Strip(segments, glyphs.shape[1]))
    return strips
