"""Health, plots and camera: the same sheets for a live run and a replay."""

from dataclasses import replace

import numpy as np
import pytest
from textual.widgets import OptionList, Static

from stack.telemetry.records import StageTiming
from stack.types import (
    CameraModel,
    CameraState,
    Detection,
    Image,
    LoopStatistics,
    SensorState,
)
from tests.tui.sample_source import SampleSource
from tui.app import Dashboard
from tui.drawing import palette
from tui.figures import KEPT, Figures, figures_of
from tui.sheets.camera import Picture, picture_strips
from tui.sheets.health import HealthSheet, loop_colour, sensor_colour, stage_colour
from tui.sheets.plots import SPANS, Plot, PlotSheet, scale_of
from tui.sheets.sheet import Sheet


@pytest.fixture
async def pilot():
    async with Dashboard(SampleSource(), live=False).run_test(size=(120, 40)) as pilot:
        await pilot.pause()
        yield pilot


def lines(widget) -> str:
    return "\n".join(widget.render_line(y).text for y in range(widget.size.height))


@pytest.mark.parametrize("key", ["H", "P", "C"])
async def test_a_key_opens_a_sheet_and_the_stop_works_on_it(pilot, key):
    await pilot.press(key)
    await pilot.pause()
    assert isinstance(pilot.app.screen, Sheet)
    await pilot.press("space")
    assert [command.kind for command in pilot.app.source.sent] == ["estop"]
    assert pilot.app.source.pictures == (key == "C")
    await pilot.press("escape")
    await pilot.pause()
    assert not isinstance(pilot.app.screen, Sheet) and not pilot.app.source.pictures


@pytest.mark.parametrize("name", ["health", "plots", "camera"])
async def test_a_snapshot_that_comes_before_the_widgets_of_a_sheet_does_no_harm(pilot, name):
    pilot.app.action_sheet(name)
    assert isinstance(pilot.app.screen, Sheet) and not pilot.app.screen.is_mounted
    pilot.app.show(pilot.app.snapshot)
    await pilot.pause()
    pilot.app.show(pilot.app.snapshot)
    assert pilot.app.screen.is_mounted


@pytest.mark.parametrize(
    ("state", "colour"),
    [
        (SensorState("a", 10.0, 10.0, 0.1), palette.GOOD),
        (SensorState("a", 7.9, 10.0, 0.1), palette.WARN),  # below 80 %
        (SensorState("a", 10.0, 10.0, 1.1), palette.BAD),
        (SensorState("a", 0.5, 0.5, 4.0), palette.GOOD),  # within five periods of 2 s
        (SensorState("a", 3.0, 0.0, 9.0), palette.IDLE),
    ],
)
def test_the_colour_of_a_sensor(state, colour):
    assert sensor_colour(state) == colour


@pytest.mark.parametrize(
    ("loop", "colour"),
    [
        (LoopStatistics(500.0, 10000, 0), palette.GOOD),
        (LoopStatistics(500.0, 10000, 10), palette.WARN),
        (LoopStatistics(500.0, 10000, 11), palette.BAD),  # more than one in a thousand
        (LoopStatistics(500.0, 10000, lacks=("priority: denied",)), palette.WARN),
    ],
)
def test_the_colour_of_a_fast_loop(loop, colour):
    assert loop_colour(loop) == colour


async def test_health_shows_the_fast_loop(pilot):
    await pilot.press("H")
    await pilot.pause()
    assert "Fast loop" not in str(pilot.app.screen.query_one(Static).render())
    late = (0,) * 8 + (990,) + (0,) * 4 + (10,)  # the bins end at 16 and at 91 µs
    loop = LoopStatistics(500.0, 1000, 2, 80e-6, 21e-6, 60e-6, late, ("priority: denied",))
    pilot.app.source.changes["fast_loop"] = loop
    pilot.app.refresh_now()
    text = str(pilot.app.screen.query_one(Static).render())
    row = next(line for line in text.splitlines() if "500 Hz" in line)
    assert row.split() == "✘ 500 Hz 16 µs 80 µs 80 µs 21 µs 2×".split()
    assert "▲ without priority: denied" in text


@pytest.mark.parametrize(
    ("median", "slow", "colour"),
    [(0.01, 0.04, palette.GOOD), (0.01, 0.06, palette.WARN), (0.06, 0.09, palette.BAD)],
)
def test_the_colour_of_a_stage(median, slow, colour):
    assert stage_colour(StageTiming(0.01, 0.1, 9, 0, median, slow, 0.05)) == colour


async def test_health_compares_rates_with_what_is_expected(pilot):
    await pilot.press("H")
    await pilot.pause()
    assert isinstance(pilot.app.screen, HealthSheet)
    shown = str(pilot.app.screen.query_one(Static).render())
    for row in ("✔ lidar", "▲ sonar_left", "✘ imu", "▲ navigate", "312 MB", "complete"):
        assert row in shown, row
    pilot.app.source.changes["records_lost"] = "sensors.mcap from 3.0 s on (no space)"
    pilot.app.refresh_now()
    assert "sensors.mcap from 3.0 s on" in str(pilot.app.screen.query_one(Static).render())


async def test_a_number_is_plotted_by_enter_and_the_choice_is_kept(pilot):
    await pilot.press("P")
    await pilot.pause()
    sheet = pilot.app.screen
    assert isinstance(sheet, PlotSheet)
    await pilot.press("slash", *"batt", "enter", "enter")
    await pilot.pause()
    assert [option.id for option in sheet.query_one(OptionList).options] == ["battery %"]
    assert "battery %" in lines(sheet.query_one(Plot))
    await pilot.press("minus", "minus")
    assert "300 s, + -" in str(sheet.query_one(".sheet").border_subtitle)
    assert "-10 s" in lines(sheet.query_one(Plot))  # there are no more than 10 s yet
    await pilot.press("escape", "escape", "P")
    await pilot.pause()
    assert "battery %" in lines(pilot.app.screen.query_one(Plot))


def test_every_number_of_a_snapshot_can_be_plotted():
    snapshot = replace(SampleSource().poll(), blackboard={"visits": "3", "name": "lab"})
    found = figures_of(snapshot)
    assert found["battery %"] == pytest.approx(snapshot.battery.charge * 100)
    assert found["key visits"] == 3.0 and "key name" not in found
    assert found["navigate ms"] == pytest.approx(5.2)
    assert found["counter replans"] == 7.0


def test_figures_keep_ten_minutes_and_the_last_span_is_given():
    snapshot, figures = SampleSource().poll(), Figures()
    for second in range(700):
        figures.add(replace(snapshot, time=float(second), health=second / 1000.0))
    times, values = figures.series("health", KEPT)
    assert (times[0], times[-1]) == (99.0, 699.0)
    assert values[-1] == pytest.approx(0.699)
    assert len(figures.series("health", SPANS[0])[0]) == 11
    assert len(figures.series("nothing", 60.0)[0]) == 0


def test_the_scale_fits_all_curves_with_a_twentieth_as_margin():
    assert scale_of([np.array([0.0, 2.0]), np.array([-2.0, 1.0])]) == pytest.approx((-2.2, 2.2))
    low, high = scale_of([np.array([5.0, 5.0])])
    assert low < 5.0 < high


def picture() -> Image:
    """32 × 24 pixels of a camera of 320 × 240: red above, blue below."""
    pixels = np.zeros((24, 32, 3), dtype=np.uint8)
    pixels[:12, :, 0] = pixels[12:, :, 2] = 255
    camera = CameraModel(320, 240, 300.0, (0.0, 0.0, 0.3))
    return Image(1.0, pixels, camera)


def test_a_picture_is_drawn_with_two_pixels_in_a_character():
    found = picture_strips(picture(), (), 32, 12)
    assert len(found) == 12 and found[0].cell_length == 32
    top, bottom = (strip._segments[1].style for strip in (found[0], found[-1]))
    assert top.color.triplet.hex == top.bgcolor.triplet.hex == "#ff0000"
    assert bottom.color.triplet.hex == "#0000ff"


def test_a_detection_is_drawn_at_its_place_in_the_whole_picture():
    """Box from pixel 80 of 320: a quarter of the width."""
    near = Detection("red", 1.0, (1.0, 0.0), 0.1, 0.2, 0.2, (80, 60, 160, 120))
    found = picture_strips(picture(), (near, replace(near, label="old", stamp=-5.0)), 32, 12)
    text = found[3].text  # pixel 60 of 240 is row 3 of 12
    assert text.index("red") == 8 and "old" not in "".join(strip.text for strip in found)


async def test_without_a_picture_the_camera_says_why(pilot):
    await pilot.press("C")
    await pilot.pause()
    assert "no camera" in lines(pilot.app.screen.query_one(Picture))
    source = pilot.app.source
    source.changes["cameras"] = (CameraState("camera"),)
    pilot.app.refresh_now()
    assert "no behaviour asks" in lines(pilot.app.screen.query_one(Picture))
    source.changes |= {"cameras": (CameraState("camera", is_on=True),), "image": picture()}
    pilot.app.refresh_now()
    assert "▀" in lines(pilot.app.screen.query_one(Picture))
