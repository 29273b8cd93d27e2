"""Six pictures of the dashboard, compared character by character and colour by colour."""

import re

import numpy as np
import pytest
from syrupy.extensions.single_file import SingleFileSnapshotExtension

from stack.telemetry.records import Debugging, MissionState
from stack.types import CameraModel, CameraState, Detection, Image
from tests.tui.sample_source import SampleSource, finished
from tui.app import Dashboard

TICK, SEEN = 420, 120


@pytest.fixture(autouse=True)
def no_animations(monkeypatch):
    monkeypatch.setenv("TEXTUAL_ANIMATIONS", "none")


class Svg(SingleFileSnapshotExtension):
    """A picture per file; the random number of rich's style names is left out."""

    file_extension = "svg"

    def serialize(self, data, **options):
        return super().serialize(re.sub(r"\bterminal-\d+-", "terminal-", data).encode(), **options)


@pytest.fixture
def is_as_before(snapshot):
    """Compare a picture of the dashboard with the one in __snapshots__.

    `pytest --snapshot-update` replaces it.
    """

    async def compare(app, before, size):
        async with app.run_test(size=size) as pilot:
            await before(pilot)
            await pilot.wait_for_scheduled_animations()
            picture = app.export_screenshot(simplify=True)
        return picture == snapshot.use_extension(Svg)

    return compare


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
async def test_running(is_as_before, size):
    app, before = watched()
    assert await is_as_before(app, before, size)


SIZES = pytest.mark.parametrize(
    "size", [(80, 24), (120, 40), (200, 60)], ids="{0[0]}x{0[1]}".format
)


@SIZES
@pytest.mark.parametrize(
    "keys", ["e", "H", "P", "g enter"], ids=["tune", "health", "plots", "place"]
)
async def test_screens(is_as_before, size, keys):
    app, before = watched(*keys.split())
    assert await is_as_before(app, before, size)


@SIZES
async def test_camera(is_as_before, size):
    """Grey bands with a red square, in which a detector has found the square."""
    pixels = np.zeros((120, 160, 3), dtype=np.uint8)
    pixels[:] = np.repeat(np.array([40, 90, 140, 190], dtype=np.uint8), 40)[None, :, None]
    pixels[40:80, 60:100] = (220, 40, 40)
    camera = CameraModel(640, 480, 500.0, (0.0, 0.0, 0.3))
    found = Detection("red", 42.0, (1.0, 0.0), 0.1, 0.2, 0.2, (240, 160, 400, 320))

    def look(source):
        source.changes.update(
            image=Image(41.9, pixels, camera),
            detections=(found,),
            cameras=(CameraState("camera", is_on=True),),
        )

    app, before = watched("C", then=look)
    assert await is_as_before(app, before, size)


async def test_emergency_stop(is_as_before):
    def stop(source):
        source.changes.update(state=MissionState.EMERGENCY_STOP, reason="operator")

    app, before = watched("2", then=stop)
    assert await is_as_before(app, before, (120, 40))


async def test_failed(is_as_before):
    reason = "office patrol > rounds > visit > go to lab: NO_VALID_PATH: the door of lab is blocked"
    app, before = watched(then=lambda source: finished(source, MissionState.FAILURE, reason))
    assert await is_as_before(app, before, (80, 24))


async def test_help(is_as_before):
    app, before = watched("question_mark")
    assert await is_as_before(app, before, (80, 24))


async def test_stopped_at_a_breakpoint(is_as_before):
    def stop(source):
        held = Debugging(breakpoints=(9, 11), held=(11,), forced={"10": "success"})
        reason = "stopped at breakpoint: before 'report it' (02_office_patrol.yaml:31)"
        source.changes.update(state=MissionState.PAUSED, reason=reason, debugging=held)

    app, before = watched("1", then=stop)
    assert await is_as_before(app, before, (120, 40))
