"""What the terminal shows, cell by cell, so that only changes are written to it.

Textual writes a changed region from the left edge of its widget, with the whole style before each
run of text. Over a slow connection that is most of the traffic. `TerminalCells` compares the new
lines with the cells already shown, and writes the differing cells and the differing part of their
styles.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from itertools import groupby
from unicodedata import category

from rich.cells import get_character_cell_size
from rich.color import ColorSystem
from rich.console import Console
from rich.style import Style
from textual._compositor import ChopsUpdate, CompositorUpdate, LayoutUpdate
from textual.strip import Strip

from tui.terminal.ascii_glyphs import to_ascii
from tui.terminal.themes import (
    AREAS,
    DOTS,
    WORDS,
    Codes,
    area_without_colours,
    codes_of,
    usual_theme,
)

Cell = tuple[str, Codes]
"""Text of a cell and its codes. The right half of a wide character has the empty text."""

PLAIN: Codes = ("", "", "")
UNKNOWN: Cell = ("\0", PLAIN)
"""A cell of which it is not known what the terminal shows."""

HALF_BLOCK = "▀"
"""Two areas above each other: foreground and background."""

SHORT_GAP = 3
"""Longest run of unchanged cells of the same style that is written again rather than skipped."""


class TerminalCells:
    """Cells that the terminal shows.

    Args:
        ascii_only: write ASCII characters for all others.
        theme: one of `themes.THEMES`; empty: the usual one for the colours of the terminal.

    Attributes:
        theme: as given; after a change, call `forget` and write a full update.
    """

    def __init__(self, ascii_only: bool = False, theme: str = "") -> None:
        self._ascii_only, self.theme = ascii_only, theme
        self._lines: list[list[Cell]] = []
        self._strips: list[dict[int, Strip]] = []  # by line and column, as far as wholly shown
        self._codes = PLAIN
        self._system = ColorSystem.TRUECOLOR
        self._written: list[str] = []

    def forget(self) -> None:
        """Assume nothing about what the terminal shows; the next full update writes all of it."""
        self._lines, self._strips = [], []

    @property
    def text(self) -> str:
        """All cells as lines of text."""
        return "\n".join("".join(text for text, _ in line).rstrip() for line in self._lines)

    @property
    def ansi(self) -> str:
        """All cells as lines of text with SGR sequences."""
        lines = []
        for line in self._lines:
            pieces = groupby(line, key=lambda cell: cell[1])
            lines.append("".join(
                f"\x1b[{';'.join(['0', *filter(None, codes)])}m{''.join(text for text, _ in cells)}"
                for codes, cells in pieces
            ))  # fmt: skip
        return "\n".join(lines)

    def changes(self, update: CompositorUpdate) -> CompositorUpdate:
        """Return an update that writes only the cells that differ from those shown."""
        known = isinstance(update, ChopsUpdate | LayoutUpdate)
        return _CellUpdate(self, update) if known else update

    def write(self, update: CompositorUpdate, system: ColorSystem) -> str:
        """Return the characters and escape sequences for the changed cells of an update."""
        written = self._written = []
        self._system = system
        if isinstance(update, LayoutUpdate):
            self._fit(update.region.right, update.region.bottom)
            for y, line in enumerate(update.strips, update.region.y):
                self._line(y, _placed(line), update.region.x, update.region.right)
        elif isinstance(update, ChopsUpdate):
            for y, first, end in update.spans:
                if y < len(self._lines):
                    placed = [(x, strip) for x, strip in update.chops[y].items() if strip]
                    self._line(y, placed, first, end)
        if written:
            written.append("\x1b[0m")
            self._codes = PLAIN
        return "".join(written)

    def _fit(self, columns: int, lines: int) -> None:
        """Forget everything when the size of the screen has changed."""
        if len(self._lines) != lines or (lines and len(self._lines[0]) != columns):
            self._lines = [[UNKNOWN] * columns for _ in range(lines)]
            self._strips = [{} for _ in range(lines)]

    def _line(self, y: int, placed: Iterable[tuple[int, Strip]], first: int, end: int) -> None:
        """Write the changes between two columns of a line.

        Args:
            y: line of the screen.
            placed: column and content of each part of the line.
            first: first column that is written.
            end: column after the last.
        """
        shown = self._strips[y]
        for x, strip in placed:
            if x >= end or x + strip.cell_length <= first:
                continue
            if shown.get(x) == strip:
                continue
            cells = self._cells(strip)
            begin, stop = max(first, x), min(end, x + len(cells), len(self._lines[y]))
            for start, other in list(shown.items()):
                if start < stop and start + other.cell_length > begin:
                    del shown[start]
            if begin == x and stop == x + len(cells):
                shown[x] = strip
            self._compare(y, begin, cells[begin - x : stop - x])

    def _cells(self, strip: Strip) -> list[Cell]:
        cells: list[Cell] = []
        for text, style, control in strip:
            if control:
                continue
            words, dots = self._codes_of(style, WORDS), self._codes_of(style, DOTS)
            if text.isascii() and text.isprintable():
                cells.extend([(character, words) for character in text])
                continue
            for character in text:
                width, shown = _width(character), _safe(character)
                if width == 1 and "\u2580" <= character < "\u25a0":
                    cells.append(self._block(shown, style))
                    continue
                if self._ascii_only:
                    shown = to_ascii(shown)
                if width == 1:
                    is_dots = "\u2800" <= character < "\u2900"
                    cells.append((shown, dots if is_dots else words))
                elif width == 2:
                    cells.extend([(shown, words), (" " if self._ascii_only else "", words)])
                elif cells and shown != "?" and not self._ascii_only:
                    cells[-1] = (cells[-1][0] + shown, cells[-1][1])  # combining
        return cells

    def _block(self, block: str, style: Style | None) -> Cell:
        """A block character, which shows an area."""
        if self.theme == "none" and block == HALF_BLOCK and style is not None:
            block = area_without_colours(style)
        return to_ascii(block) if self._ascii_only else block, self._codes_of(style, AREAS)

    def _codes_of(self, style: Style | None, kind: str) -> Codes:
        if style is None:
            return PLAIN
        return codes_of(style, self._system, self.theme or usual_theme(self._system), kind)

    def _compare(self, y: int, x: int, cells: list[Cell]) -> None:
        """Write the cells that differ from those shown, from column x on."""
        line, written = self._lines[y], self._written
        before = line[x : x + len(cells)]
        if before == cells:
            return
        line[x : x + len(cells)] = cells
        at = -1  # index of the cell that the cursor is at; -1: elsewhere
        for index, (cell, old) in enumerate(zip(cells, before, strict=True)):
            if cell == old or not cell[0]:
                continue
            if at != index:
                gap = cells[at:index] if 0 <= at else []
                if gap and len(gap) <= SHORT_GAP and all(c[1] == self._codes for c in gap):
                    written.extend(c[0] for c in gap)
                elif at < 0:
                    written.append(f"\x1b[{y + 1};{x + index + 1}H")
                else:
                    written.append(f"\x1b[{x + index + 1}G")
            if cell[1] != self._codes:
                written.append(transition(self._codes, cell[1]))
                self._codes = cell[1]
            written.append(cell[0])
            at = index + (2 if index + 1 < len(cells) and not cells[index + 1][0] else 1)


class _CellUpdate(CompositorUpdate):
    """An update that is compared with the cells when it is written."""

    def __init__(self, cells: TerminalCells, update: CompositorUpdate) -> None:
        self._cells, self._update = cells, update

    def render_segments(self, console: Console) -> str:
        """Return the output for the terminal."""
        return self._cells.write(self._update, console._color_system or ColorSystem.TRUECOLOR)


def _placed(strips: Iterable[Strip | None]) -> list[tuple[int, Strip]]:
    """Return the column of each strip of a line."""
    placed, x = [], 0
    for strip in strips:
        if strip is not None:
            placed.append((x, strip))
            x += strip.cell_length
    return placed


@lru_cache(maxsize=8192)
def transition(before: Codes, after: Codes) -> str:
    """Return the escape sequence that changes from one style to another."""
    if before[0] != after[0]:
        return f"\x1b[{';'.join(['0', *(part for part in after if part)])}m"
    parts = [
        new or default
        for old, new, default in zip(before[1:], after[1:], ("39", "49"), strict=True)
        if old != new
    ]
    return f"\x1b[{';'.join(parts)}m"


@lru_cache(maxsize=4096)
def _safe(character: str) -> str:
    """Return the character, or `?` for one that terminals obey: the last of several barriers."""
    return "?" if category(character) in ("Cc", "Cf", "Cs", "Zl", "Zp") else character


@lru_cache(maxsize=4096)
def _width(character: str) -> int:
    return get_character_cell_size(character)
