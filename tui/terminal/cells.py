"""What the terminal shows, cell by cell, so that only changes are written to it.

Textual writes a changed region from the left edge of its widget, with the whole style before each
run of text. Over a slow connection that is most of the traffic. `TerminalCells` compares the new
lines with the cells already shown, and writes the differing cells and the differing part of their
styles.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from unicodedata import category

from rich.cells import get_character_cell_size
from rich.color import ColorSystem
from rich.console import Console
from rich.style import Style
from textual._compositor import ChopsUpdate, CompositorUpdate, LayoutUpdate
from textual.strip import Strip

from tui.terminal.ascii_glyphs import to_ascii

Codes = tuple[str, str, str]
"""SGR parameters of a cell: attributes, foreground, background; empty: the terminal's default."""

Cell = tuple[str, Codes]
"""Text of a cell and its codes. The right half of a wide character has the empty text."""

PLAIN: Codes = ("", "", "")
UNKNOWN: Cell = ("\0", PLAIN)
"""A cell of which it is not known what the terminal shows."""

SHORT_GAP = 3
"""Longest run of unchanged cells of the same style that is written again rather than skipped."""

ATTRIBUTES = ("bold", "dim", "italic", "underline", "blink", "blink2", "reverse", "conceal",
              "strike")  # fmt: skip
"""Attributes of Rich's styles whose SGR parameters are 1, 2, 3…"""


class TerminalCells:
    """Cells that the terminal shows.

    Args:
        ascii_only: write ASCII characters for all others.
    """

    def __init__(self, ascii_only: bool = False) -> None:
        self._ascii_only = ascii_only
        self._lines: list[list[Cell]] = []
        self._strips: list[dict[int, Strip]] = []  # by line and column, as far as wholly shown
        self._codes = PLAIN
        self._system = ColorSystem.TRUECOLOR
        self._written: list[str] = []

    def forget(self) -> None:
        """Assume nothing about what the terminal shows; the next full update writes all of it."""
        self._lines, self._strips = [], []

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
            codes = codes_of(style, self._system) if style is not None else PLAIN
            legible = legible_codes(codes)
            if text.isascii() and text.isprintable():
                cells.extend([(character, legible) for character in text])
                continue
            for character in text:
                width, shown = _width(character), _safe(character)
                if self._ascii_only:
                    shown = to_ascii(shown)
                if width == 1:
                    is_drawing = (
                        "\u2580" <= character < "\u25a0" or "\u2800" <= character < "\u2900"
                    )
                    cells.append((shown, codes if is_drawing else legible))
                elif width == 2:
                    cells.extend([(shown, legible), (" " if self._ascii_only else "", legible)])
                elif cells and shown != "?" and not self._ascii_only:
                    cells[-1] = (cells[-1][0] + shown, cells[-1][1])  # combining
        return cells

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
def codes_of(style: Style, system: ColorSystem) -> Codes:
    """Return the SGR parameters of a style."""
    attributes = [str(n) for n, name in enumerate(ATTRIBUTES, 1) if getattr(style, name)]
    colours = [
        ";".join(colour.downgrade(system).get_ansi_codes(foreground)) if colour else ""
        for colour, foreground in ((style.color, True), (style.bgcolor, False))
    ]
    return ";".join(attributes), colours[0], colours[1]


@lru_cache(maxsize=8192)
def legible_codes(codes: Codes) -> Codes:
    """Return codes for text: white instead of the colour of the background.

    With 16 colours, two different ones may become the same.
    """
    attributes, foreground, background = codes
    if foreground.isdigit() and background == str(int(foreground) + 10):
        return attributes, "30" if foreground in ("37", "97") else "97", background
    return codes


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
