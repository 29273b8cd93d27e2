"""rerun gets what is written to a recording, while it grows and from its begin on."""

from __future__ import annotations

import rerun as rr

from missions.execution.supervision.live_recording import LiveRecording
from tests.missions.execution.test_engine import until


def test_the_viewer_gets_a_growing_file_whole(tmp_path):
    whole, growing, got = tmp_path / "a.rrd", tmp_path / "b.rrd", tmp_path / "c.rrd"
    with rr.RecordingStream("test") as stream:
        stream.save(whole)
        for number in range(300):
            stream.set_time("t", sequence=number)
            stream.log("x", rr.Scalars(float(number)))
    content = whole.read_bytes()
    viewer = LiveRecording(growing, ["--save", str(got)])  # instead of a window
    with growing.open("wb") as file:
        file.write(content[: len(content) // 2])
        file.flush()
        until(lambda: got.exists() and got.stat().st_size > 0)
        file.write(content[len(content) // 2 :])
    until(lambda: got.stat().st_size >= len(content))
    viewer.close()
    until(lambda: not viewer.is_open)
