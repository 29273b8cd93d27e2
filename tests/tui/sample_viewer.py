"""The dashboard of a sample run in this terminal: `python -m tests.tui.sample_viewer FILE [KIND]`.

At the end the file has a JSON object: how the dashboard ended, and the commands it sent. It is
written under another name first. KIND is one of

* moving: the patrol goes on for SHOWN frames, and then stands (the default);
* hostile: every name and text has escape sequences in it;
* crash: reading fails after SHOWN frames.
"""

import json
import signal
import sys
from dataclasses import replace
from fcntl import ioctl
from pathlib import Path
from termios import TIOCSCTTY

from stack.telemetry.records import Event, Snapshot
from stack.types import Limitation
from tests.tui.sample_source import SampleSource
from tui.viewer import show

SHOWN = 8
HOSTILE = "\x1b]0;owned\x07\x1b[2J\x9b31m\u202e\n"


class Patrol(SampleSource):
    """A run that is over, so that q leaves at once, with a snapshot that says it goes on."""

    def __init__(self, kind: str) -> None:
        super().__init__(300)
        self.is_over, self.report = True, {}
        self._kind, self._frames = kind, 0
        if kind == "hostile" and self.info is not None:
            places = {f"{name}{HOSTILE}": pose for name, pose in self.info.places.items()}
            self.info = replace(self.info, title=f"title{HOSTILE}", places=places)

    def poll(self) -> Snapshot | None:
        self._frames += 1
        self.tick += self._frames <= SHOWN
        if self._kind == "crash" and self._frames > SHOWN:
            raise ValueError("out of [cheese]")
        snapshot = super().poll()
        return _spoilt(snapshot) if snapshot is not None and self._kind == "hostile" else snapshot

    def events(self) -> list[Event]:
        events = super().events()
        if self._kind != "hostile":
            return events
        return [replace(event, text=f"{event.text}{HOSTILE}") for event in events]


def _spoilt(snapshot: Snapshot) -> Snapshot:
    rows = tuple(
        replace(row, name=f"{HOSTILE}{row.name}", message=f"{HOSTILE}{row.message}")
        for row in snapshot.tree
    )
    limits = (Limitation("slower", "obstacle", f"safety{HOSTILE}"),)
    return replace(snapshot, tree=rows, reason=f"reason{HOSTILE}", limitations=limits)


if __name__ == "__main__":
    ioctl(0, TIOCSCTTY, 0)  # this terminal's signals come to this process
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    source = Patrol(sys.argv[2] if len(sys.argv) > 2 else "moving")
    outcome = show(source, lambda: False)
    result = Path(sys.argv[1])
    unfinished = result.with_suffix(".new")
    sent = [command.kind for command in source.sent]
    unfinished.write_text(json.dumps([outcome.name, outcome.traceback, sent]), "utf-8")
    unfinished.replace(result)
