"""Dialogs of the dashboard: questions and help."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical, VerticalScroll
from textual.screen import ModalScreen
from textual.widgets import Input, Label, OptionList, Static
from textual.widgets.option_list import Option

from tui.drawing import palette
from tui.drawing.palette import BUSY, DIM, TEXT, css
from tui.drawing.strips import one_line
from tui.keys import KEYS, TREE_KEYS, TREE_SENTENCE, Key

MEANINGS = (
    ("✔", "success", palette.GOOD), ("✘", "failure", palette.BAD), ("▶", "running", palette.BUSY),
    ("·", "idle", palette.DIM), ("━", "plan", palette.PATH), ("━", "local", palette.LOCAL_PLAN),
    ("━", "driven", palette.TRAIL), ("•", "scan", palette.SCAN), ("•", "belief", palette.PARTICLE),
    ("•", "old scan", palette.DIM), ("•", "unmapped", palette.BEAM_SHORT),
    ("•", "beyond", palette.BEAM_LONG), ("●", "break", palette.BAD), ("◆", "forced", palette.WARN),
    ("○", "people", palette.PERSON), ("⚑", "goal", palette.GOAL), ("▪", "marker", palette.MARKER),
    ("━", "shut door", palette.BAD), ("━", "open door", palette.PLACE), ("█", "wall", palette.WALL),
    ("█", "sensed", palette.SENSED), ("█", "too close", palette.COST_HIGH),
)  # fmt: skip
"""Glyphs: words on the scan, unmapped: before what the map shows; beyond: behind it."""

MEANINGS_PER_LINE = 6


class Question(ModalScreen[str]):
    """A question with a list of answers; escape returns the empty answer."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("escape", "cancel", "Back")]

    def __init__(self, question: str, answers: dict[str, str]) -> None:
        """Create the dialog.

        Args:
            question: one line.
            answers: result of the dialog -> text of the answer; the safe answer first.
        """
        super().__init__()
        self._question, self._answers = question, answers

    def compose(self) -> ComposeResult:
        """Compose the question and its answers."""
        with Vertical(classes="dialog"):
            yield Label(self._question, markup=False)
            options = (Option(one_line(text), id=key) for key, text in self._answers.items())
            yield OptionList(*options, markup=False)
            yield Static(f"[{css(DIM)}]enter selects · esc cancels · space: emergency stop[/]")

    def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        """Return the selected answer."""
        self.dismiss(event.option.id)

    def action_cancel(self) -> None:
        """Return the empty answer."""
        self.dismiss("")


class AskText(ModalScreen[str | None]):
    """Asks for a text of one line; escape returns None.

    Args:
        question: its title.
        example: what is shown while it is empty.
    """

    BINDINGS: ClassVar[list[BindingType]] = [Binding("escape", "cancel", "Back")]

    def __init__(self, question: str, example: str) -> None:
        super().__init__()
        self._question, self._example = question, example

    def compose(self) -> ComposeResult:
        """Compose the text and a hint."""
        with Vertical(classes="dialog editing") as dialog:
            dialog.border_title = self._question
            line = Input(placeholder=self._example)
            line.cursor_blink = False
            yield line
            yield Static(f"[{css(DIM)}]enter searches · esc cancels · ctrl+space stops[/]")

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Return the text."""
        self.dismiss(event.value)

    def action_cancel(self) -> None:
        """Return None."""
        self.dismiss(None)


class Help(ModalScreen[None]):
    """All keys, and the meaning of the glyphs; `/` filters the lines."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("question_mark,q", "close", "Back"),
        Binding("escape", "back", "Back"),
        Binding("slash", "filter", "Filter"),
    ]

    def __init__(self, keys: Sequence[Key]) -> None:
        super().__init__()
        self._keys = keys

    def compose(self) -> ComposeResult:
        """Compose one line per key, then the glyphs."""
        with VerticalScroll(classes="dialog wide") as dialog:
            dialog.border_title = "Keys"
            dialog.border_subtitle = "/ filters · esc closes"
            line = Input(placeholder="part of a line; ctrl+space stops the robot")
            line.cursor_blink = False
            yield line
            yield Static(_lines(self._keys))

    def action_filter(self) -> None:
        """Ask for words; only lines with them are shown."""
        self.query_one(".dialog").add_class("editing")
        self.query_one(Input).focus()

    def on_input_changed(self, event: Input.Changed) -> None:
        """Show the lines that have the words."""
        self.query_one(Static).update(_lines(self._keys, event.value))

    def action_back(self) -> None:
        """End the filter, or close the help."""
        dialog, line = self.query_one(".dialog"), self.query_one(Input)
        if not dialog.has_class("editing"):
            self.dismiss(None)
            return
        dialog.remove_class("editing")
        line.value = ""
        dialog.focus()

    def action_close(self) -> None:
        """Close the help."""
        self.dismiss(None)


def _lines(keys: Sequence[Key], words: str = "") -> Text:
    """The keys as lines, those that have all the words; without words, the glyphs too."""
    text, wanted = Text(), words.lower().split()
    lines = [(key.shown, key.sentence) for key in keys if key.sentence]
    if keys is KEYS:
        lines.append((" ".join(key.shown for key in TREE_KEYS), TREE_SENTENCE))
    widest = max(len(shown) for shown, _ in lines)
    for shown, sentence in lines:
        if not all(word in f"{shown} {sentence}".lower() for word in wanted):
            continue
        text.append(f"{shown:>{widest}}  ", style=f"bold {css(BUSY)}")
        text.append(f"{sentence}\n", style=css(TEXT))
    for number, (glyph, word, colour) in enumerate(MEANINGS if not wanted else ()):
        text.append("\n" if number and not number % MEANINGS_PER_LINE else "", style=css(TEXT))
        text.append(f"{glyph} ", style=f"bold {css(colour)}")
        text.append(f"{word:<10}", style=css(TEXT))
    return text
