"""A sheet over the panes, below the status bar; it shows each new snapshot."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import ClassVar

from textual.binding import BindingType
from textual.screen import ModalScreen

from stack.telemetry.records import Snapshot
from tui.figures import Figures
from tui.keys import SHEET_KEYS
from tui.link import Link


@dataclass(frozen=True)
class Shown:
    """What a sheet shows.

    Attributes:
        snapshot: the newest.
        link: state of the connection.
        figures: numbers of the last minutes.
    """

    snapshot: Snapshot
    link: Link
    figures: Figures


class Sheet(ModalScreen[None]):
    """A sheet; the keys of SHEET_KEYS close it."""

    BINDINGS: ClassVar[list[BindingType]] = [key.binding() for key in SHEET_KEYS]
    TAKES_PICTURES: ClassVar[bool] = False
    """Whether the camera's pictures are wanted while it is shown."""

    def show(self, shown: Shown) -> None:
        """Show a new snapshot; nothing while its widgets are not there yet, or no longer."""
        if self.is_mounted and self.is_attached:
            self.fill(shown)

    @abstractmethod
    def fill(self, shown: Shown) -> None:
        """Fill the widgets."""

    def action_close(self) -> None:
        """Return to the panes."""
        self.dismiss(None)
