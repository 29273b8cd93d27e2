"""Questions and help, over the dashboard."""

from __future__ import annotations

from typing import ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.screen import ModalScreen
from textual.widgets import Label, OptionList, Static
from textual.widgets.option_list import Option

from tui.keys import KEYS
from tui.palette import BUSY, TEXT, css


class Question(ModalScreen[str]):
    """A question with a few answers; escape answers nothing."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("escape", "cancel", "Back")]

    def __init__(self, question: str, answers: dict[str, str]) -> None:
        super().__init__()
        self._question, self._answers = question, answers

    def compose(self) -> ComposeResult:
        """The question and its answers; the harmless one is first."""
        with Vertical(classes="dialog"):
            yield Label(self._question)
            yield OptionList(*(Option(text, id=key) for key, text in self._answers.items()))

    def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        """An answer was chosen."""
        self.dismiss(event.option.id or "")

    def action_cancel(self) -> None:
        """No answer."""
        self.dismiss("")


class Help(ModalScreen[None]):
    """All keys, from the one table, and what the glyphs mean."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape,question_mark,q", "dismiss", "Back"),
    ]

    def compose(self) -> ComposeResult:
        """One line a key."""
        text = Text()
        for key in KEYS:
            shown = key.shown_as or key.keys
            text.append(f"{shown:>7}  ", style=f"bold {css(BUSY)}")
            text.append(f"{key.sentence}\n", style=css(TEXT))
        text.append("\n  ✔ success   ✘ failure   ▶ running   · not yet\n", style=css(TEXT))
        with Vertical(classes="dialog wide"):
            yield Label("Keys")
            yield Static(text)
