"""Asks for a pose: by the name of a place, by coordinates, or on the map."""

from __future__ import annotations

from collections.abc import Mapping
from math import degrees
from typing import ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import BindingType
from textual.containers import Vertical
from textual.screen import ModalScreen
from textual.widgets import Input, OptionList, Static
from textual.widgets.option_list import Option

from stack.errors import ParameterError
from stack.parameters import read_pose
from stack.types import Pose2D
from tui.drawing.palette import BAD, DIM, css
from tui.drawing.strips import one_line
from tui.keys import PLACE_KEYS

ON_MAP = "on the map"
HINT = (
    "a place, or x, y, heading: 2.5, 3 m, 90 deg\n"
    "enter takes it · esc cancels · ctrl+space stops the robot"
)


def pose_words(pose: Pose2D) -> str:
    """A pose for people, in metres and degrees."""
    return f"({pose.x:.2f}, {pose.y:.2f}), {degrees(pose.heading):.0f}°"


class PlaceScreen(ModalScreen[Pose2D | str | None]):
    """Returns a pose, ON_MAP to choose it there, or None.

    Args:
        question: its title.
        places: named poses.
    """

    BINDINGS: ClassVar[list[BindingType]] = [key.binding() for key in PLACE_KEYS]

    def __init__(self, question: str, places: Mapping[str, Pose2D]) -> None:
        super().__init__()
        self._question, self._places = question, places

    def compose(self) -> ComposeResult:
        """Compose the text, the places that it fits, and a hint."""
        with Vertical(classes="dialog editing") as dialog:
            dialog.border_title = self._question
            line = Input(placeholder="a name, or x, y, heading")
            line.cursor_blink = False
            yield line
            yield OptionList(markup=False)
            yield Static(f"[{css(DIM)}]{HINT}[/]", id="hint")

    def on_mount(self) -> None:
        """List all places."""
        self.query_one(OptionList).can_focus = False
        self._list("")

    def on_input_changed(self, event: Input.Changed) -> None:
        """List the places that the text fits."""
        self._list(event.value)

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Return the coordinates, or the chosen place; or say what is wrong."""
        text = event.value
        if "," in text and text not in self._places:
            try:
                self.dismiss(read_pose([part.strip() for part in text.split(",")]))
            except ParameterError as error:
                self._say(" · ".join(filter(None, (error.sentence, str(error.hint)))))
            return
        rows = self.query_one(OptionList)
        if rows.highlighted is None:
            self._say(f"there is no place {text!r}; coordinates are written as 2.5, 3, 90 deg")
            return
        self._choose(rows.get_option_at_index(rows.highlighted).id or ON_MAP)

    def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        """Return a place that was clicked."""
        self._choose(event.option.id or ON_MAP)

    def action_choose(self, lines: int) -> None:
        """Choose a place further down."""
        rows = self.query_one(OptionList)
        if rows.option_count:
            rows.highlighted = max(0, min((rows.highlighted or 0) + lines, rows.option_count - 1))

    def action_cancel(self) -> None:
        """Return None."""
        self.dismiss(None)

    def _choose(self, name: str) -> None:
        self.dismiss(self._places.get(name, name))

    def _list(self, text: str) -> None:
        words = text.lower()
        fitting = [name for name in self._places if words in name.lower()]
        fitting.sort(key=lambda name: not name.lower().startswith(words))
        options = [Option("choose it on the map", id=ON_MAP)] if not text else []
        options += [
            Option(one_line(f"{name}  {pose_words(self._places[name])}"), id=name)
            for name in fitting
        ]
        rows = self.query_one(OptionList)
        rows.set_options(options)
        rows.highlighted = 0 if options else None

    def _say(self, text: str) -> None:
        self.query_one("#hint", Static).update(Text(one_line(text), style=css(BAD)))
