"""Parameters of the running mission: filter, look up, change, and save the changed ones."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import BindingType
from textual.containers import Vertical
from textual.screen import ModalScreen
from textual.widgets import Input, OptionList, Static
from textual.widgets.option_list import Option

from stack.documents import as_yaml
from stack.parameters import quantity_unit
from stack.telemetry.records import Ack
from stack.types import ParameterInfo
from tui.drawing.palette import BAD, BUSY, DIM, GOOD, TEXT, WARN, css
from tui.drawing.strips import one_line
from tui.keys import PICKER_KEYS

HINT = "letters filter · enter changes · ctrl+e experts · ctrl+s saves\nctrl+space stops the robot"
YES, NO = ("true", "yes", "on", "1"), ("false", "no", "off", "0")

NAME_WIDTH = 38
"""Columns of the names in the list."""

Send = Callable[[str, object, Callable[[Ack], None]], None]
"""send(name, value, answered): set a parameter; the engine's answer comes later."""


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
    if isinstance(present, float):
        return _number(text)
    if isinstance(present, list | tuple):
        return [part.strip() for part in text.strip("[]()").split(",") if part.strip()]
    return None if present is None and text in ("", "none") else text


def _number(text: str) -> float | str:
    """A number, or the text of one with a unit; raise ValueError for anything else."""
    try:
        return float(text)
    except ValueError:
        if text[:1] in "+-.0123456789" and quantity_unit(text) is not None:
            return text
        raise ValueError(f"{text!r}: expected a number, with a unit or without") from None


def shown_value(value: object, unit: str) -> str:
    """A value as people write it: 0.5 m/s, true, none."""
    if value is None:
        return "none"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, list | tuple):
        return ", ".join(shown_value(item, "") for item in value)
    text = f"{value:g}" if isinstance(value, float) else str(value)
    return f"{text} {unit}".rstrip()


def parameter_file(changed: Mapping[str, Any], known: Mapping[str, ParameterInfo]) -> str:
    """A parameter file with these values by full name.

    The two costmaps of a run have one component in files, in which what concerns the local one
    alone is called `local_…`.
    """
    components: dict[str, dict[str, Any]] = {}
    for full, value in changed.items():
        component, _, name = full.partition(".")
        if component == "local_costmap" and f"{component}.local_{name}" in known:
            name = f"local_{name}"
        component = "costmap" if component.endswith("_costmap") else component
        components.setdefault(component, {})[name] = list(value) if _is_list(value) else value
    return as_yaml(components)


def _is_list(value: object) -> bool:
    return isinstance(value, list | tuple)


class ParameterScreen(ModalScreen[None]):
    """List of the parameters with a filter; the chosen one is changed in place.

    Args:
        table: what they are.
        values: present values by name.
        send: sets one.
        file: the parameter file for the changed ones.
    """

    BINDINGS: ClassVar[list[BindingType]] = [key.binding() for key in PICKER_KEYS]

    def __init__(
        self, table: Sequence[ParameterInfo], values: Mapping[str, Any], send: Send, file: Path
    ) -> None:
        super().__init__()
        self._table = {item.name: item for item in table}
        self._values, self._send, self._file = values, send, file
        self._experts = not any(item.public for item in table)
        self._listed: list[ParameterInfo] = []
        self._editing: ParameterInfo | None = None

    def compose(self) -> ComposeResult:
        """Compose filter, list, meaning of the chosen parameter, its new value, and a hint."""
        with Vertical(classes="dialog wide picker") as dialog:
            dialog.border_title = "Parameters"
            yield Input(placeholder="filter: part of a name or of the meaning", id="filter")
            yield OptionList(markup=False)
            yield Static(id="meaning")
            yield Input(id="value")
            yield Static(f"[{css(DIM)}]{HINT}[/]", id="hint")

    def on_mount(self) -> None:
        """List the parameters; the cursor does not blink."""
        for line in self.query(Input):
            line.cursor_blink = False
        self.query_one(OptionList).can_focus = False
        self._list()
        self.query_one("#filter").focus()

    def show(self, values: Mapping[str, Any]) -> None:
        """Show the values of a newer snapshot."""
        if self.is_mounted and values != self._values:
            self._values = values
            self._list()

    def on_input_changed(self, event: Input.Changed) -> None:
        """Filter the list while a word is typed."""
        if event.input.id == "filter":
            self._list()

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Begin to change the chosen parameter, or send its new value."""
        if event.input.id == "filter":
            self._edit(self._chosen)
        elif self._editing is not None:
            self._change(self._editing, event.value)

    def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        """Change a parameter that was clicked."""
        self._edit(self._table[event.option.id or ""])

    def on_option_list_option_highlighted(self) -> None:
        """Show the meaning of the chosen parameter."""
        self._explain()

    def action_choose(self, lines: int) -> None:
        """Choose a parameter further down the list."""
        if self._listed and self._editing is None:
            rows = self.query_one(OptionList)
            at = (rows.highlighted or 0) + lines
            rows.highlighted = max(0, min(at, len(self._listed) - 1))

    def action_experts(self) -> None:
        """List the parameters for experts too, or no longer."""
        self._experts = not self._experts
        self._list()

    def action_save(self) -> None:
        """Write the changed parameters to a file."""
        changed = {item.name: self._values[item.name] for item in self._table.values()
                   if self._is_changed(item)}  # fmt: skip
        if not changed:
            self._say("nothing has been changed", WARN)
            return
        try:
            self._file.write_text(parameter_file(changed, self._table), "utf-8")
        except OSError as error:
            self._say(f"cannot write {self._file}: {error.strerror}", BAD)
            return
        count = f"{len(changed)} changed parameter{'s' if len(changed) > 1 else ''}"
        self._say(f"{count} saved; in a mission: `parameters: [{self._file.name}]`", GOOD)

    def action_back(self) -> None:
        """Leave the value, then the list."""
        if self._editing is None:
            self.dismiss(None)
            return
        self._editing = None
        self.query_one(".dialog").remove_class("editing")
        self.query_one("#filter").focus()
        self._say(HINT, DIM)

    @property
    def _chosen(self) -> ParameterInfo | None:
        at = self.query_one(OptionList).highlighted
        return self._listed[at] if at is not None and at < len(self._listed) else None

    def _is_changed(self, item: ParameterInfo) -> bool:
        return shown_value(self._values.get(item.name), "") != shown_value(item.start, "")

    def _list(self) -> None:
        """List what the filter passes; the chosen one stays chosen."""
        before = self._chosen
        words = self.query_one("#filter", Input).value.lower().lstrip("/").split()
        self._listed = [
            item for item in self._table.values()
            if (item.public or self._experts or self._is_changed(item))
            and all(word in f"{item.name} {item.help}".lower() for word in words)
        ]  # fmt: skip
        rows = self.query_one(OptionList)
        rows.set_options([Option(self._row(item), id=item.name) for item in self._listed])
        rows.highlighted = self._listed.index(before) if before in self._listed else 0
        kind = "all" if self._experts else "for users"
        dialog = self.query_one(".dialog")
        dialog.border_subtitle = f"{len(self._listed)} of {len(self._table)}, {kind}"
        self._explain()

    def _row(self, item: ParameterInfo) -> Text:
        changed = self._is_changed(item)
        row = Text("● " if changed else "  ", style=css(WARN), no_wrap=True, overflow="ellipsis")
        row.append(one_line(f"{item.name:<{NAME_WIDTH}} "), style=css(TEXT))
        value = one_line(shown_value(self._values.get(item.name), item.unit))
        row.append(value, style=css(WARN if changed else BUSY))
        return row

    def _explain(self) -> None:
        item, text = self._editing or self._chosen, Text()
        if item is None:
            text.append("no parameter has these words; ctrl+e lists those for experts")
        else:
            text.append(one_line(item.help), style=css(TEXT))
            kinds = item.type, item.range, "" if item.public else "for experts"
            text.append("\n" + one_line(" · ".join(filter(None, kinds))), style=css(DIM))
            if self._is_changed(item):
                began = one_line(shown_value(item.start, item.unit))
                text.append(f" · at the start {began}", style=css(WARN))
        self.query_one("#meaning", Static).update(text)

    def _edit(self, item: ParameterInfo | None) -> None:
        if item is None:
            return
        self._editing = item
        self.query_one(".dialog").add_class("editing")
        line = self.query_one("#value", Input)
        line.value = shown_value(self._values.get(item.name), item.unit)
        line.border_title = one_line(item.name)
        line.focus()
        self._say("enter sets it, with a unit or without · esc leaves it · ctrl+space stops", DIM)
        self._explain()

    def _change(self, item: ParameterInfo, text: str) -> None:
        try:
            value = parsed(text, self._values.get(item.name))
        except ValueError as error:
            self._say(str(error), BAD)
            return
        self._say(f"setting {item.name}…", DIM)
        self._send(item.name, value, lambda ack: self._answered(item, ack))

    def _answered(self, item: ParameterInfo, ack: Ack) -> None:
        if not ack.done:
            self._say(ack.reason, BAD)
            return
        if self._editing is item:
            self.action_back()
        self._say(f"{item.name} is set", GOOD)

    def _say(self, text: str, colour: int) -> None:
        if self.is_attached:
            self.query_one("#hint", Static).update(Text(one_line(text), style=css(colour)))
