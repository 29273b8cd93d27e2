"""What is written for a change, and that it gives the same screen as writing everything."""

from __future__ import annotations

import random

import pytest
from rich.color import ColorSystem
from rich.segment import Segment
from rich.style import Style
from textual._compositor import ChopsUpdate, LayoutUpdate
from textual.geometry import Region
from textual.strip import Strip

from tests.tui.terminal_screen import TerminalScreen
from tui.terminal.cells import PLAIN, TerminalCells, transition
from tui.terminal.themes import codes_of

WIDTH, HEIGHT = 24, 5
RED, BLUE = Style(color="#ff0000", bgcolor="#000000"), Style(color="#0000ff", bgcolor="#000000")


def whole(*lines: str, style: Style = RED) -> LayoutUpdate:
    """A full update; each line is filled with spaces."""
    rows = [*lines, *[""] * (HEIGHT - len(lines))]
    strips = [[Strip([Segment(row.ljust(WIDTH), style)], WIDTH)] for row in rows]
    return LayoutUpdate(strips, Region(0, 0, WIDTH, HEIGHT))


def written(cells: TerminalCells, update, system=ColorSystem.TRUECOLOR) -> str:
    return cells.write(update, system)


def test_the_same_again_writes_nothing():
    cells = TerminalCells()
    assert "speed 0.48" in written(cells, whole("speed 0.48"))
    assert written(cells, whole("speed 0.48")) == ""


def test_of_a_change_only_the_cells_are_written():
    cells = TerminalCells()
    written(cells, whole("speed 0.48", "time 12.3"))
    # Line 1 column 10, in red on black; then line 2 column 6 in the same style, and column 9.
    assert written(cells, whole("speed 0.49", "time 32.4")) == (
        "\x1b[1;10H\x1b[38;2;255;0;0;48;2;0;0;0m9\x1b[2;6H32.4\x1b[0m"
    )


def test_of_a_style_only_the_difference_is_written():
    before, after = (codes_of(style, ColorSystem.TRUECOLOR, "dark") for style in (RED, BLUE))
    assert transition(before, after) == "\x1b[38;2;0;0;255m"
    assert transition(after, PLAIN) == "\x1b[39;49m"
    bold = codes_of(RED + Style(bold=True), ColorSystem.TRUECOLOR, "dark")
    assert transition(before, bold) == "\x1b[0;1;38;2;255;0;0;48;2;0;0;0m"
    assert transition(bold, before) == "\x1b[0;38;2;255;0;0;48;2;0;0;0m"


def test_forgotten_cells_are_written_again():
    cells = TerminalCells()
    first = written(cells, whole("map"))
    cells.forget()
    assert written(cells, whole("map")) == first


@pytest.mark.parametrize("character", ["\x1b", "\x07", "\x9b", "\u202e", "\x00"])
@pytest.mark.parametrize("ascii_only", [False, True])
def test_no_control_character_passes(character, ascii_only):
    assert character not in written(
        TerminalCells(ascii_only), whole(f"a{character}b"), ColorSystem.STANDARD
    ).replace("\x1b[", "")


def test_an_ascii_terminal_gets_ascii():
    output = written(TerminalCells(ascii_only=True), whole("╭─ ▶ naïve ⣿ 図 ─╮"))
    assert output.isascii()
    assert "+- > naive : ?  -+" in output


def test_random_changes_in_pieces_give_the_screen_of_a_whole_write():
    """Two thousand updates of spans, in lines of two parts that are cut elsewhere each time."""
    rng = random.Random(5)
    cells, screen = TerminalCells(), TerminalScreen(WIDTH, HEIGHT)
    lines = [[" "] * WIDTH for _ in range(HEIGHT)]
    screen.feed(written(cells, whole()))
    for _ in range(2000):
        y, first = rng.randrange(HEIGHT), rng.randrange(WIDTH)
        end = rng.randrange(first, WIDTH) + 1
        for x in range(first, end):
            lines[y][x] = rng.choice("  ab█⣿")
        cut = rng.randrange(1, WIDTH)
        parts = {0: lines[y][:cut], cut: lines[y][cut:]}
        chops = [{} for _ in range(HEIGHT)]
        chops[y] = {
            x: Strip([Segment("".join(part), rng.choice((RED, BLUE)))], len(part))
            for x, part in parts.items()
        }
        ends = [[cut, WIDTH]] * HEIGHT
        screen.feed(written(cells, ChopsUpdate(chops, [(y, first, end)], ends)))
    assert screen.text == "\n".join("".join(line).rstrip() for line in lines)
