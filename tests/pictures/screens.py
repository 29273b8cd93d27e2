"""Screens of the dashboard on a recorded run, as SVG.

The dashboard is the one of a live run: it is given the snapshots of the recording as if they came
from the engine, and a clock that only the pictures move.
"""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass
from pathlib import Path

from stack.telemetry.records import Snapshot
from stack.telemetry.snapshots.recording import SnapshotRecording
from tui.app import Dashboard
from tui.replay.app import ReplayDashboard
from tui.replay.player import Player
from tui.run_view import RunView
from tui.terminal.themes import THEMES

STEP = 0.25
"""Robot time between two refreshes, s."""

WATCHED = 60.0
"""Robot time that has been watched before the pictures, s."""


@dataclass(frozen=True)
class Screen:
    """A screen, and the keys that open it; escape leads back to the panes."""

    name: str
    keys: tuple[str, ...] = ()


@dataclass(frozen=True)
class Visit:
    """Screens of one dashboard on one run.

    Attributes:
        run: name of the run.
        at: robot time of the pictures, s.
        screens: what is drawn.
        is_replay: whether it is the dashboard of a replay.
    """

    run: str
    at: float
    screens: tuple[Screen, ...]
    is_replay: bool = False


def typed(text: str) -> tuple[str, ...]:
    """Keys of a text."""
    return tuple({" ": "space"}.get(letter, letter) for letter in text)


VISITS = (
    Visit("office", 47.0, (
        Screen("main"), Screen("health", ("H",)),
        Screen("plots", ("P", "down", "down", "enter", "down", "down", "down", "enter")),
        Screen("parameters", ("e",)), Screen("help", ("question_mark",)),
        Screen("search", ("slash", *typed("desk"), "enter")), Screen("place", ("g",)),
        Screen("placing", ("g", "enter", "up", "up", "up", "left_square_bracket")),
        Screen("tree", ("1", "z")), Screen("events", ("4", "z")), Screen("charts", ("5", "z")),
        Screen("disturb", ("D",)), Screen("quit", ("q",)),
    )),
    Visit("red_box", 31.9, (Screen("camera", ("C",)), Screen("camera_main"))),
    Visit("arm", 9.0, (Screen("arm"),)),
    Visit("corridor", 19.5, (Screen("recovery"),)),
    Visit("office", 60.0, (Screen("replay"), Screen("replay_time", ("colon",)),
                           Screen("replay_help", ("question_mark",))), True),
)  # fmt: skip


class Watched(Player):
    """A recorded run as a live one: each refresh of the dashboard is STEP later."""

    def __init__(self, folder: Path, begin: float) -> None:
        self.wall = 0.0
        super().__init__(SnapshotRecording(folder), lambda: self.wall)
        self.seek(begin)

    def poll(self) -> Snapshot | None:
        """The snapshot at the head."""
        snapshot = super().poll()
        self.wall += STEP
        return snapshot


async def drawn(
    visit: Visit, folder: Path, size: tuple[int, int], wanted: Callable[[str], bool]
) -> AsyncIterator[tuple[str, str]]:
    """The screens of a visit, as name and SVG.

    Args:
        visit: screens of a run.
        folder: of the run.
        size: of the terminal, columns and lines.
        wanted: whether a picture with a name is drawn.
    """
    names = {
        (screen, theme): f"{screen.name}-{theme}-{size[0]}x{size[1]}"
        for screen in visit.screens for theme in THEMES
    }  # fmt: skip
    if not any(map(wanted, names.values())):
        return
    player = Watched(folder, visit.at - WATCHED)
    app: RunView = (
        ReplayDashboard(player, live=False) if visit.is_replay else Dashboard(player, live=False)
    )
    async with app.run_test(size=size) as pilot:
        if not visit.is_replay:
            player.land()
        while player.time < visit.at:
            app.refresh_now()
        player.toggle()
        await pilot.pause()  # the footer comes late
        for screen in visit.screens:
            await pilot.press(*screen.keys)
            app.refresh_now()
            await pilot.pause()
            for theme in THEMES:
                if wanted(name := names[screen, theme]):
                    app.show_theme(theme)
                    yield name, app.export_screenshot()
            while len(app.screen_stack) > 1:
                await pilot.press("escape")
            await pilot.press("escape", "2")
