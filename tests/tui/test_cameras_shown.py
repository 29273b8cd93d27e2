"""Cameras in the dashboard: their state in the vitals, depth obstacles on the map."""

import asyncio
from dataclasses import replace
from math import inf

import numpy as np
import pytest

from stack.types import CameraState
from tests.tui.sample_source import SampleSource
from tui.app import Dashboard
from tui.drawing import palette
from tui.panes.map_pane import MapPane
from tui.panes.vitals_pane import VitalsPane


class Watching(SampleSource):
    """The sample patrol with cameras."""

    def __init__(self, **fields):
        super().__init__()
        self.fields = fields

    def poll(self):
        snapshot = super().poll()
        return None if snapshot is None else replace(snapshot, **self.fields)


def shown(**fields):
    """Text of the vitals, and the map pane, of a dashboard that has shown a snapshot."""

    async def look():
        app = Dashboard(Watching(**fields), live=False)
        async with app.run_test(size=(150, 44)) as pilot:
            app.refresh_now()
            await pilot.pause()
            vitals, plan = app.query_one(VitalsPane), app.query_one(MapPane)
            return vitals._shown.plain, plan._canvas, str(plan.border_subtitle)

    return asyncio.run(look())


def test_cameras_that_are_on_or_faulty_have_a_line():
    cameras = (
        CameraState("camera", False, inf),
        CameraState("front", True, 0.05),
        CameraState("rear", True, inf),
        CameraState("depth", True, 1.2, "silent"),
    )
    text, _, _ = shown(cameras=cameras)
    lines = [line.strip() for line in text.splitlines()]
    assert "cameras  front: 0.05 s old" in lines
    assert "rear: no picture yet" in lines and "depth: silent, 1.20 s old" in lines
    assert not any("camera:" in line for line in lines)


@pytest.mark.parametrize("is_used", [False, True])
def test_depth_obstacles_have_a_colour_of_their_own(is_used):
    pose = SampleSource().poll().pose
    points = np.array([(pose.x + 1.0, pose.y + 0.1 * n, 0.2) for n in range(8)], np.float32)
    _, canvas, legend = shown(depth_points=points if is_used else None)
    assert bool((canvas.foreground == palette.DEPTH).any()) == is_used
    assert ("depth" in legend) == is_used
