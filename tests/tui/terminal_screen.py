"""A terminal of few words: the text that stands on it after the output of the dashboard."""

from __future__ import annotations

import re

from rich.cells import get_character_cell_size

PIECE = re.compile(
    r"\x1b\[(?P<arguments>[0-?]*)[ -/]*(?P<final>[@-~])"
    r"|\x1b(?P<string>[PX^_\]]).*?(?:\x1b\\|\x07)"
    r"|\x1b(?P<other>[ -/]*[0-~])"
    r"|(?P<control>[\x00-\x1a\x1c-\x1f\x7f-\x9f])"
    r"|(?P<text>[^\x00-\x1f\x7f-\x9f]+)",
    re.S,
)


class TerminalScreen:
    """Lines of a terminal without scrolling; obeys cursor positions and text.

    Attributes:
        strings: escape sequences with a string that were obeyed, such as a new window title.
        controls: control characters other than line feed and carriage return.
    """

    def __init__(self, columns: int, lines: int) -> None:
        self.lines = [[" "] * columns for _ in range(lines)]
        self.strings: list[str] = []
        self.controls: list[str] = []
        self._column = self._line = 0

    @property
    def text(self) -> str:
        """All lines."""
        return "\n".join("".join(line).rstrip() for line in self.lines)

    def feed(self, output: str) -> None:
        """Obey some output."""
        for piece in PIECE.finditer(output):
            if piece["final"]:
                self._move(piece["arguments"], piece["final"])
            elif piece["string"]:
                self.strings.append(piece[0])
            elif piece["control"] == "\n":
                self._line += 1
                self._column = 0  # the terminal's line discipline adds the return
            elif piece["control"] not in (None, "\r"):
                self.controls.append(piece[0])
            elif piece["text"]:
                self._write(piece["text"])

    def _move(self, arguments: str, final: str) -> None:
        numbers = [int(part or 1) for part in re.findall(r"\d+", arguments)] or [1]
        if final == "H" and not arguments.startswith("?"):
            numbers.append(1)
            self._line, self._column = numbers[0] - 1, numbers[1] - 1
        elif final == "G":
            self._column = numbers[0] - 1

    def _write(self, text: str) -> None:
        for character in text:
            width = get_character_cell_size(character)
            inside = 0 <= self._line < len(self.lines)
            if inside and width and self._column < len(self.lines[self._line]):
                self.lines[self._line][self._column] = character
            self._column += width
