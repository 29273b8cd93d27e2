"""Every key of every table, in a live run and in a replay: what it changes, and nothing else.

The test walks the tables, so that a new key without a line here fails.
"""

import pytest
from textual.widgets import Input, OptionList

from stack.telemetry.records import MissionState
from stack.telemetry.snapshots.recording import SnapshotRecording
from tests.tui.recorded_run import Wall, record
from tests.tui.sample_source import SampleSource
from tui.app import Dashboard
from tui.keys import (
    DRAFT_KEYS,
    FOUND_KEYS,
    KEYS,
    PICKER_KEYS,
    PLACE_KEYS,
    PLOT_KEYS,
    SHEET_KEYS,
    TREE_KEYS,
)
from tui.panes.events_pane import EventsPane
from tui.panes.map_pane import MapPane
from tui.panes.tree_pane import TreePane
from tui.replay.app import ReplayDashboard
from tui.replay.player import Player
from tui.run_view import PANES
from tui.terminal.themes import THEMES


class Any:
    """Equal to everything, where that something changes is all that matters."""

    def __eq__(self, other):
        return True


ANY = Any()


def observed(app):
    """What keys can change, by name."""
    panes, screen = app.panes, app.screen
    pane, tree, events = (panes.query_one(kind) for kind in (MapPane, TreePane, EventsPane))
    view, draft = pane.view, pane.draft
    found = {
        "screen": type(screen).__name__, "focus": getattr(app.focused, "id", None),
        "scale": round(view.metres_per_dot, 6), "centre": (round(view.x, 6), round(view.y, 6)),
        "following": pane.following, "costs": pane.costs_shown,
        "draft": None if draft is None else (draft.kind, draft.pose),
        "node": tree.chosen, "pinned": tree.pinned,
        "level": events._filter, "match": (events._wanted, events._match),
        "full": [name for name in PANES if panes.has_class(f"full-{name}")],
        "theme": app.shown_theme, "drawn": bool(app._cells._lines), "left": app.left,
        "told": app.told,
    }  # fmt: skip
    if len(app.screen_stack) > 1:
        lists = screen.query(OptionList)
        found["row"] = lists.first().highlighted if lists else None
        found["rows"] = lists.first().option_count if lists else None
        found["typed"] = [(line.display, line.value) for line in screen.query(Input)]
        found["span"] = getattr(screen, "_span", None)
    if isinstance(app, Dashboard):
        found["sent"] = [command.kind for command in app.source.sent]
    else:
        player = app.source
        found |= {"playing": player.is_playing, "time": player.time, "factor": player.factor}
    return found


def changes(before, after):
    return {key: value for key, value in after.items() if before.get(key) != value}


def every(keys, effect):
    return {key: effect for key in keys}


def sends(*kinds):
    return {"sent": list(kinds)}


def opens(screen, **more):
    """A dialog or sheet over the panes; what is in it is not part of the key."""
    return {
        "screen": screen,
        "focus": ANY,
        "row": ANY,
        "rows": ANY,
        "typed": ANY,
        "span": ANY,
    } | more


NOTHING = {}
VIEW = {
    **every(("plus", "equals_sign", "minus"), {"scale": ANY, "following": True, "centre": ANY}),
    "f": ("plus", {"scale": ANY, "following": False, "centre": ANY}),
    **every(("left", "right", "up", "down"), {"centre": ANY}),
    "c": {"costs": False}, "slash": opens("AskText"), "l": {"level": "warnings and errors"},
    "t": ("1 up", {"pinned": False, "node": ANY}),
    "1": {"focus": "tree"}, "2": ("1", {"focus": "map"}), "3": {"focus": "vitals"},
    "4": {"focus": "events"}, "5": {"focus": "charts"},
    "H": opens("HealthSheet"), "P": opens("PlotSheet"), "C": opens("CameraSheet"),
    "T": {"theme": "light", "drawn": False, "told": ANY}, "z": {"full": ["map"], "scale": ANY},
    "escape": ("z", {"full": [], "scale": ANY}), "ctrl+l": {"drawn": False},
    "question_mark": opens("Help"),
    "q": opens("Question"), "ctrl+q": opens("Question"),
}  # fmt: skip

LIVE = VIEW | {
    **every(("space", "shift+space", "ctrl+space", "ctrl+@"), sends("estop")),
    "R": sends("release"), "p": sends("pause"), "a": opens("Question"),
    "e": opens("ParameterScreen"),
    "g": opens("PlaceScreen"), "i": opens("PlaceScreen"), "G": sends("cancel_goal"),
    "B": sends("drop_box"), "O": sends("move_door"), "L": {"draft": ANY}, "D": opens("Question"),
    **every(("less_than_sign", "comma", "greater_than_sign", "full_stop"),
            sends("speed") | {"told": ANY}),
    "enter": NOTHING, "shift+left": NOTHING, "shift+right": NOTHING, "ctrl+c": opens("Question"),
}  # fmt: skip
"""Key -> what it changes; or keys that are pressed before, and what it changes then."""

TELEOPERATION = {
    **every(("left", "right", "up", "down", "shift+left", "shift+right"), sends("teleop")),
    "enter": sends("teleop_done"),
}
"""Of those, the keys that drive the robot while the mission lets the operator."""

TREE = {
    "b": sends("break"), "n": sends("step"), "f": opens("Question"), "c": sends("continue"),
}  # fmt: skip

DRAFT = {
    "enter": {"draft": None, "sent": ["set_goal"]}, "escape": {"draft": None},
    **every(("left", "right", "up", "down"), {"draft": ANY}),
    **every(("left_square_bracket", "right_square_bracket"), {"draft": ANY}),
    "g": NOTHING, "i": {"draft": ANY},
}  # fmt: skip

FOUND = {"n": {"match": ("tree", 1)}, "N": {"match": ("tree", 0)}, "escape": {"match": ANY}}
CLOSED = {"screen": "Screen", "focus": "map"}
SHEET = every(("escape", "H", "P", "C"), CLOSED)
PLOT = {
    **every(("plus", "equals_sign"), {"span": 30.0}), "minus": {"span": 120.0},
    "slash": {"focus": ANY, "typed": [(True, "")]},
}  # fmt: skip
PLACE = {"up": ("down", {"row": 0}), "down": {"row": 1}, "escape": CLOSED}
PICKER = {
    "ctrl+e": {"rows": ANY, "row": ANY}, "ctrl+s": NOTHING, "escape": CLOSED,
    "up": ("down", {"row": 0}), "down": {"row": 1}, "pageup": ("down", {"row": 0}),
    "pagedown": {"row": ANY},
}  # fmt: skip

MOVED = {"time": ANY}
STOPPED = {"time": ANY, "playing": False}
REPLAY = VIEW | {
    **every(("space", "shift+space", "p"), {"playing": False}),
    "full_stop": STOPPED, "comma": STOPPED,
    **every(("right_square_bracket", "left_square_bracket", "right_curly_bracket",
              "left_curly_bracket", "home", "end"), MOVED),
    "greater_than_sign": {"factor": 2.0, "told": ANY},
    "less_than_sign": {"factor": 0.5, "told": ANY},
    "n": STOPPED, "N": STOPPED, "x": STOPPED, "X": {"told": ANY}, "s": STOPPED, "S": STOPPED,
    "ctrl+c": {"left": "leave"}, "q": {"left": "leave"}, "ctrl+q": {"left": "leave"},
    "colon": opens("AskTime"), "enter": opens("WholeText"),
}  # fmt: skip

REFUSED = ("a", "e", "g", "i", "R", "G", "B", "O", "L", "D", "b")
"""Keys of a live run that do nothing in a replay."""

TABLES = {
    "live": (KEYS, LIVE, ""), "teleoperation": ((), TELEOPERATION, ""),
    "tree": (TREE_KEYS, TREE, "1"), "draft": (DRAFT_KEYS, DRAFT, "g enter"),
    "found": (FOUND_KEYS, FOUND, "slash t r e e enter"), "sheet": (SHEET_KEYS, SHEET, "H"),
    "plots": (PLOT_KEYS, PLOT, "P"), "places": (PLACE_KEYS, PLACE, "g"),
    "parameters": (PICKER_KEYS, PICKER, "e"),
}  # fmt: skip
"""Name -> the table, what its keys change, and the keys that lead to where they work."""


def names_of(table):
    return {name for key in table for name in key.keys.split(",")}


async def press_each(pilot, table, effects, opening):
    """Press each key of a table, from the same state each time."""
    app = pilot.app
    if table:
        assert set(effects) == names_of(table)
    for key, effect in effects.items():
        before_keys, expected = effect if isinstance(effect, tuple) else ("", effect)
        await begin_again(pilot)
        await pilot.press(*opening.split(), *before_keys.split())
        app.refresh_now()
        await pilot.pause()
        if isinstance(app, Dashboard):
            app.source.sent.clear()
        before = observed(app)
        await pilot.press(key)
        await pilot.pause()
        found = changes(before, observed(app))
        ignored = {name for name, value in expected.items() if value is ANY}
        assert {**dict.fromkeys(ignored, ANY), **found} == expected, key


async def begin_again(pilot):
    """The panes as they are at first, and in a replay the middle of the run."""
    app = pilot.app
    while len(app.screen_stack) > 1:
        app.pop_screen()
    pane, events = app.query_one(MapPane), app.query_one(EventsPane)
    pane.action_drop_draft()
    pane.fit()
    pane.costs_shown, app.left = True, ""
    app.query_one(TreePane).follow()
    events.action_end_search()
    while events._filter != "info and up":
        events.next_filter()
    app.action_all_panes()
    app.show_theme(THEMES[0])
    app._cells._lines = [[]]
    pane.focus()
    if isinstance(app, ReplayDashboard):
        player = app.source
        player.seek(10.0)
        player.is_playing, player.factor = True, 1.0
    app.refresh_now()
    await pilot.pause()


def remember_leaving(app):
    """Let the app go on after it was left; keep how, and count the messages, which go away."""
    app.left, app.told = "", 0

    def leave(result):
        app.left = result

    def notify(*_, **__):
        app.told += 1

    app.exit, app.notify = leave, notify
    return app


@pytest.mark.parametrize("table", TABLES)
async def test_every_key_of_a_live_run(table, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # ctrl+s writes a file there
    app = remember_leaving(Dashboard(SampleSource(), live=False))
    async with app.run_test(size=(120, 40)) as pilot:
        app.refresh_now()
        app.source.changes["teleop"] = table == "teleoperation"
        await press_each(pilot, *TABLES[table])


async def test_every_key_of_a_replay(tmp_path):
    record(tmp_path)
    app = remember_leaving(ReplayDashboard(Player(SnapshotRecording(tmp_path), Wall()), live=False))
    async with app.run_test(size=(120, 40)) as pilot:
        await press_each(pilot, ReplayDashboard.KEYS, REPLAY, "")
        await press_each(pilot, (), every(REFUSED, NOTHING), "")


async def test_pause_becomes_resume_and_the_end_is_left_at_once():
    app = remember_leaving(Dashboard(SampleSource(), live=False, owns_run=True))
    async with app.run_test(size=(80, 24)) as pilot:
        app.source.changes["state"] = MissionState.PAUSED
        app.refresh_now()
        await pilot.press("p")
        assert [command.kind for command in app.source.sent] == ["resume"]
        await pilot.press("ctrl+c")
        assert app.left == "interrupt"
        app.source.is_over = True
        await pilot.press("q")
        assert app.left == "over"
