"""Six pictures of the dashboard, compared character by character and colour by colour."""

import pytest

from stack.telemetry.records import Debugging, MissionState
from tests.tui.sample_source import SampleSource, finished
from tui.app import Dashboard

TICK, SEEN = 420, 120


@pytest.fixture(autouse=True)
def no_animations(monkeypatch):
    monkeypatch.setenv("TEXTUAL_ANIMATIONS", "none")


def watched(*keys, then=None):
    """A dashboard and what to do before its picture: watch for a while, change, press keys."""
    source = SampleSource(TICK - SEEN)
    app = Dashboard(source, live=False)

    async def before(pilot):
        while source.tick < TICK:
            source.tick += 1
            app.refresh_now()
        if then is not None:
            then(source)
        app.refresh_now()
        await pilot.press(*keys)
        await pilot.pause()

    return app, before


@pytest.mark.parametrize("size", [(80, 24), (120, 40), (180, 50)], ids="{0[0]}x{0[1]}".format)
def test_running(snap_compare, size):
    app, before = watched()
    assert snap_compare(app, run_before=before, terminal_size=size)


def test_emergency_stop(snap_compare):
    def stop(source):
        source.changes.update(state=MissionState.EMERGENCY_STOP, reason="operator")

    app, before = watched("2", then=stop)
    assert snap_compare(app, run_before=before, terminal_size=(120, 40))


def test_failed(snap_compare):
    reason = "office patrol > rounds > visit > go to lab: NO_VALID_PATH: the door of lab is blocked"
    app, before = watched(then=lambda source: finished(source, MissionState.FAILURE, reason))
    assert snap_compare(app, run_before=before, terminal_size=(80, 24))


def test_help(snap_compare):
    app, before = watched("question_mark")
    assert snap_compare(app, run_before=before, terminal_size=(80, 24))


def test_stopped_at_a_breakpoint(snap_compare):
    def stop(source):
        held = Debugging(breakpoints=(9, 11), held=(11,), forced={"10": "success"})
        reason = "stopped at breakpoint: before 'report it' (02_office_patrol.yaml:31)"
        source.changes.update(state=MissionState.PAUSED, reason=reason, debugging=held)

    app, before = watched("1", then=stop)
    assert snap_compare(app, run_before=before, terminal_size=(120, 40))
