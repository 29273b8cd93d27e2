"""What snapshots.mcap shows of real missions is what was published while they ran."""

from pathlib import Path
from random import Random

import numpy as np
import pytest

from missions.execution.prepare import RunOptions, prepare
from missions.execution.run import Run
from missions.inspection.exchange.rerun_viewer import drawn
from stack.telemetry.sinks import Sink
from stack.telemetry.snapshots.format import SLOW, recorded_fields
from stack.telemetry.snapshots.recording import SnapshotRecording
from tests.stack.telemetry.rerun_recording import rerun, rows_by_entity

SECONDS = 10.0
RATE = 5.0
"""Snapshots per second of robot time: recording.rate."""

ROOT = Path(__file__).parents[3]


class Witness(Sink):
    """Remembers every snapshot that could have been published."""

    def __init__(self):
        self.seen = []

    def wants_snapshot(self, time):
        return True

    def snapshot(self, snapshot):
        self.seen.append(snapshot)


@pytest.mark.slow
@pytest.mark.parametrize("number", ["01", "05", "18", "25", "34"])
def test_a_replay_shows_the_states_poses_and_maps_that_were_published(number, tmp_path):
    mission = next((ROOT / "missions").glob(f"{number}_*.yaml"))
    options, witness = RunOptions(seed=3, out=tmp_path / "run"), Witness()
    run = Run(prepare(mission, options), options, [witness])
    try:
        while not run.is_over and run.engine.body.time < SECONDS:
            if run.is_ready():
                run.step()
    finally:
        run.close()
    codecs = recorded_fields()
    exact = codecs.keys() - {*SLOW, "scan"}
    with SnapshotRecording(tmp_path / "run") as recording:
        for time in Random(number).choices(np.arange(0.0, recording.times[-1], 0.01), k=20):
            index = recording.index_at(time)
            shown = recording.snapshot(index)
            live = [one for one in witness.seen if one.time == shown.time][-1]
            assert time - shown.time < 1.0 / RATE + 0.01
            for name in exact:
                ours, theirs = getattr(shown, name), getattr(live, name)
                assert codecs[name].encode(ours) == codecs[name].encode(theirs), name
            assert shown.layers["map"].version == live.layers["map"].version
            cells = shown.layers["map"].content.cells
            assert np.array_equal(cells, live.layers["map"].content.cells)
            assert shown.events == live.events
            missed = [one for one in witness.seen if shown.time < one.time <= time]
            assert all(one.state is shown.state for one in missed)


@pytest.mark.slow
def test_pictures_replay_and_rerun_agree(tmp_path):
    """Of a mission that searches for a red box with its camera."""
    options, witness = RunOptions(seed=1, out=tmp_path / "run"), Witness()
    run = Run(prepare("33_find_the_red_box", options), options, [witness])
    try:
        while not run.is_over and run.engine.body.time < SECONDS:
            if run.is_ready():
                run.step()
    finally:
        run.close()
    taken = {one.image.stamp: one.image for one in witness.seen if one.image is not None}
    with SnapshotRecording(tmp_path / "run") as recording:
        shown = {
            image.stamp: image
            for number in range(len(recording.times))
            if (image := recording.snapshot(number).image) is not None
        }
    assert 5 <= len(shown) <= SECONDS + 1
    for stamp, image in shown.items():
        assert image.camera == taken[stamp].camera
        assert np.abs(image.pixels.astype(float) - taken[stamp].pixels).mean() < 3.0  # JPEG
    rerun_file = drawn(tmp_path / "run")
    assert rows_by_entity(rerun_file)["/world/camera/picture"] == 1 + len(shown)  # and its frame
    assert rerun("optimize", rerun_file, "-o", tmp_path / "indexed.rrd").returncode == 0
    assert rerun("verify", tmp_path / "indexed.rrd").returncode == 0
