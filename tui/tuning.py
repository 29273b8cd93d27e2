"""Live tuning dialog: select a parameter and type its new value."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.screen import ModalScreen
from textual.widgets import Input, Label, OptionList, Static
from textual.widgets.option_list import Option

from stack.parameters import quantity_unit
from tui.drawing.palette import BAD, DIM, css
from tui.drawing.strips import one_line

HINT = "enter selects · x lists more · esc cancels · while typing, ctrl+space stops"
YES, NO = ("true", "yes", "on", "1"), ("false", "no", "off", "0")


@dataclass(frozen=True, slots=True)
class Change:
    """New value of a parameter."""

    name: str
    value: object


def parsed(text: str, present: object) -> object:
    """Return the value of a typed text, of the same type as the parameter's present value.

    A number with a unit stays a text: the engine knows the parameter's own unit and converts it.

    Raises:
        ValueError: the text has another type; the message states what was expected.
    """
    text = text.strip()
    if isinstance(present, bool):
        if text.lower() not in YES + NO:
            raise ValueError(f"{text!r}: expected true or false")
        return text.lower() in YES
    if isinstance(present, int):
        try:
            return int(text)
        except ValueError:
            raise ValueError(f"{text!r}: expected a whole number") from None
    return _number(text) if isinstance(present, float) else text


def _number(text: str) -> float | str:
    """A number, or the text of one with a unit; raise ValueError for anything else."""
    try:
        return float(text)
    except ValueError:
        if text[:1] in "+-.0123456789" and quantity_unit(text) is not None:
            return text
        raise ValueError(f"{text!r}: expected a number, with a unit or without") from None


class ParameterScreen(ModalScreen[Change | None]):
    """List of parameters; returns the change, or None.

    Args:
        parameters: value by name.
        public: the names that are listed before the user asks for all.
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape", "cancel", "Back"),
        Binding("x", "list_all", "Parameters for experts"),
    ]

    def __init__(self, parameters: Mapping[str, Any], public: Collection[str]) -> None:
        super().__init__()
        self._parameters = dict(sorted(parameters.items()))
        self._listed = {name: self._parameters[name] for name in sorted(public)}
        self._chosen = ""

    def compose(self) -> ComposeResult:
        """Compose the list; the text input appears when a parameter is selected."""
        with Vertical(classes="dialog"):
            yield Label("Change a parameter")
            yield OptionList(*_options(self._listed or self._parameters), markup=False)
            yield Input()
            yield Static(f"[{css(DIM)}]{HINT}[/]", id="hint")

    def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        """Show the text input for the selected parameter."""
        self._chosen = event.option.id or ""
        present = self._parameters[self._chosen]
        text = one_line(f"{self._chosen} is {present}; new value:")
        self.query_one(Label).update(Text(text))
        self.query_one(".dialog").add_class("editing")
        self.query_one(OptionList).display = False
        line = self.query_one(Input)
        line.value = str(self._parameters[self._chosen])
        line.cursor_blink = False
        line.focus()

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Return the change, or show what is wrong with it."""
        try:
            value = parsed(event.value, self._parameters[self._chosen])
        except ValueError as error:
            self.query_one("#hint", Static).update(Text(one_line(str(error)), style=css(BAD)))
            return
        self.dismiss(Change(self._chosen, value))

    def action_list_all(self) -> None:
        """List the parameters for experts too."""
        if not self._chosen:
            listed = self.query_one(OptionList).set_options(_options(self._parameters))
            listed.highlighted = 0

    def action_cancel(self) -> None:
        """Close without a change."""
        self.dismiss(None)


def _options(parameters: Mapping[str, Any]) -> list[Option]:
    width = max(map(len, parameters))
    return [
        Option(one_line(f"{name:<{width}}  {value}"), id=name) for name, value in parameters.items()
    ]
