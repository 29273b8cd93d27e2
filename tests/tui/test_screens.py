"""Every screen and every state of the dashboard as text, in three sizes.

`pytest --snapshot-update` replaces the texts in __snapshots__. Colours are the subject of
terminal/test_themes.py and of the last test here.
"""

import numpy as np
import pytest

from stack.telemetry.records import Debugging, MissionState
from stack.telemetry.snapshots.recording import SnapshotRecording
from stack.types import CameraModel, CameraState, Detection, Image, Limitation
from tests.tui.recorded_run import Wall, record
from tests.tui.sample_source import SampleSource, finished
from tui.app import Dashboard
from tui.panes.map_pane import MapPane
from tui.panes.tree_pane import TreePane
from tui.replay.app import ReplayDashboard
from tui.replay.player import Player

TICK, SEEN = 420, 120
SIZES = pytest.mark.parametrize(
    "size", [(80, 24), (120, 40), (200, 60)], ids="{0[0]}x{0[1]}".format
)

SCREENS = {
    "health": "H", "plots": "P", "no camera": "C", "parameters": "e",
    "a parameter": "e enter", "help": "question_mark", "help filtered": "question_mark slash z o o",
    "search": "slash", "found": "slash s p i n enter", "place": "g", "placing": "g enter",
    "setting the pose": "i enter", "lifting": "L", "disturb": "D", "abort": "a", "quit": "q",
    "force": "1 f", "tree": "1 z", "map": "2 z", "vitals": "3 z", "events": "4 z", "charts": "5 z",
    "zoomed": "plus plus", "errors alone": "l l", "no curves": "P enter down enter",
}  # fmt: skip
"""Name and keys of each screen of a running mission."""

HELD = Debugging(breakpoints=(9, 11), held=(11,), forced={"10": "success"})
FAULTS = Debugging(faults=("a.yaml:3:1 error[E120] unknown key 'gaol'", "a.yaml:4:1 error"))
STATES = {
    "emergency stop": {"state": MissionState.EMERGENCY_STOP, "reason": "operator"},
    "paused": {"state": MissionState.PAUSED, "reason": "operator"},
    "detour": {"state": MissionState.PAUSED, "detour": True},
    "detour paused": {"state": MissionState.PAUSED, "detour_held": True},
    "breakpoint": {
        "state": MissionState.PAUSED, "debugging": HELD,
        "reason": "stopped at breakpoint: before 'report it' (02_office_patrol.yaml:31)",
    },
    "reload failed": {"debugging": FAULTS},
    "teleoperation": {
        "teleop": True, "limitations": (Limitation("slower", "obstacle", "wall 0.3 m ahead"),),
    },
    "lost": {"health": 0.04},
    "records lost": {"records_lost": "mission.rrd from 3.0 s on (no space)"},
    "starting": {"state": MissionState.STARTING, "layers": {}, "tree": (), "sensors": ()},
}  # fmt: skip
"""Name of each state, and what of the snapshot it changes."""


@pytest.fixture(autouse=True)
def still(monkeypatch):
    monkeypatch.setenv("TEXTUAL_ANIMATIONS", "none")
    monkeypatch.setenv("TERM", "xterm-256color")
    for name in ("NO_COLOR", "TREEPILOT_THEME"):
        monkeypatch.delenv(name, raising=False)


def watched(size, **options):
    """A dashboard that has been watched for a while."""
    source = SampleSource(TICK - SEEN)
    app = Dashboard(source, live=False, **options)

    def watch():
        while source.tick < TICK:
            source.tick += 4
            app.refresh_now()

    return app, source, watch


async def shown(pilot):
    """The screen as text, without messages that go away."""
    pilot.app.clear_notifications()
    pilot.app.show_theme("none")  # floor and costs are blank, so that texts are seen
    texts = []
    while len(texts) < 50:  # footer and layout come late
        pilot.app.refresh_now()
        await pilot.pause(0.02)
        texts.append(pilot.app.cells().text)
        if texts[-3:] == [texts[-1]] * 3:
            return texts[-1]
    raise AssertionError("the screen does not come to rest")


async def go_back(pilot):
    """To the panes as they were at first."""
    while len(pilot.app.screen_stack) > 1:
        await pilot.press("escape")
    pane = pilot.app.query_one(MapPane)
    pane.action_drop_draft()
    pane.fit()
    pilot.app.query_one(TreePane).follow()
    pilot.app.action_all_panes()
    pane.focus()


def changed(text, before):
    """The lines that differ from those of another screen, with their numbers."""
    both = enumerate(zip(text.split("\n"), before.split("\n"), strict=True), start=1)
    return "\n".join(f"{number:2} {line}" for number, (line, old) in both if line != old)


@SIZES
async def test_screens(snapshot, size):
    app, _, watch = watched(size)
    async with app.run_test(size=size) as pilot:
        watch()
        panes = await shown(pilot)
        assert panes == snapshot(name="panes")
        for name, keys in SCREENS.items():
            await pilot.press(*keys.split())
            assert changed(await shown(pilot), panes) == snapshot(name=name), name
            if name == "found":
                await pilot.press("escape")
            await go_back(pilot)


@SIZES
async def test_states(snapshot, size):
    app, source, watch = watched(size)
    async with app.run_test(size=size) as pilot:
        watch()
        panes = await shown(pilot)
        for name, changes in STATES.items():
            source.changes = dict(changes)
            assert changed(await shown(pilot), panes) == snapshot(name=name), name
        source.changes = {}
        for name, seconds in (("silent", 3.0), ("engine lost", 8.0)):
            source.silent_for = seconds
            assert changed(await shown(pilot), panes) == snapshot(name=name), name
        source.silent_for = 0.1
        reason = "office patrol > rounds > go to lab: NO_VALID_PATH: the door of lab is blocked"
        for state in (MissionState.SUCCESS, MissionState.FAILURE, MissionState.ABORTED):
            finished(source, state, "" if state is MissionState.SUCCESS else reason)
            found = changed(await shown(pilot), panes)
            assert found == snapshot(name=str(state)), state


@SIZES
async def test_camera(snapshot, size):
    """Grey bands with a red square, in which a detector has found the square."""
    pixels = np.zeros((120, 160, 3), dtype=np.uint8)
    pixels[:] = np.repeat(np.array([40, 90, 140, 190], dtype=np.uint8), 40)[None, :, None]
    pixels[40:80, 60:100] = (220, 40, 40)
    camera = CameraModel(640, 480, 500.0, (0.0, 0.0, 0.3))
    found = Detection("red", 42.0, (1.0, 0.0), 0.1, 0.2, 0.2, (240, 160, 400, 320))
    app, source, _ = watched(size)
    async with app.run_test(size=size) as pilot:
        source.tick = TICK
        source.changes.update(
            image=Image(41.9, pixels, camera), detections=(found,),
            cameras=(CameraState("camera", is_on=True),),
        )  # fmt: skip
        await pilot.press("C")
        assert await shown(pilot) == snapshot


@SIZES
async def test_the_demo_and_before_the_first_snapshot(snapshot, size):
    app, source, _ = watched(size, is_demo=True)
    async with app.run_test(size=size) as pilot:
        source.tick = TICK
        assert await shown(pilot) == snapshot(name="demo")
    waiting = SampleSource(-1)
    waiting.info = None
    app = Dashboard(waiting, live=False)
    async with app.run_test(size=size) as pilot:
        for name, keys in {"waiting": "", "waiting for health": "H", "waiting for plots": "P",
                           "waiting for the camera": "C"}.items():  # fmt: skip
            await pilot.press(*keys.split())
            assert await shown(pilot) == snapshot(name=name), name
            await pilot.press("escape")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("run")
    record(path)
    return path


@SIZES
async def test_replay(snapshot, folder, size):
    wall = Wall()
    player = Player(SnapshotRecording(folder), wall)
    app = ReplayDashboard(player, live=False)
    screens = {
        "at the failure": "x", "health": "H", "plots": "P", "camera": "C",
        "go to": "colon", "no time": "colon n o o n enter", "help": "question_mark",
        "at the end": "end",
    }  # fmt: skip
    async with app.run_test(size=size) as pilot:
        for _ in range(20):
            wall.now += 0.25
            app.refresh_now()
        playing = await shown(pilot)
        assert playing == snapshot(name="playing")
        for name, keys in screens.items():
            await pilot.press(*keys.split())
            assert changed(await shown(pilot), playing) == snapshot(name=name), name
            await go_back(pilot)


async def test_colours(snapshot):
    """Cell by cell, in the default theme: running, stopped, failed."""
    app, source, watch = watched((80, 24))
    async with app.run_test(size=(80, 24)) as pilot:
        watch()
        before = "\n" * 23
        for name in ("running", "stopped", "failed"):
            if name == "stopped":
                source.changes.update(state=MissionState.EMERGENCY_STOP, reason="operator")
            elif name == "failed":
                finished(source, MissionState.FAILURE, "NO_VALID_PATH: the door is blocked")
            await shown(pilot)
            app.show_theme("dark")
            found = app.cells().ansi.replace("\x1b", "\\e")
            assert changed(found, before) == snapshot(name=name), name
            before = found
