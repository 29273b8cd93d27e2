"""What draws the pictures of a run: chosen by the option, named in the event log."""

import json

import pytest

from missions.execution.running import run_mission
from missions.run_options import RunOptions
from tests.stack.sim.test_gl_drawing import reason  # noqa: F401 - of the mark

PHOTO = """
mission: photo
robot: scout
world: small_room
start: [1.5, 1.5, 0]
run:
  take_photo: {label: room}
"""


def run(folder, renderer):
    mission = folder / "photo.yaml"
    mission.write_text(PHOTO)
    out = folder / (renderer or "default")
    report = run_mission(mission, RunOptions(renderer=renderer, out=out, serve=False))
    assert report.status == "success"
    lines = (out / "events.jsonl").read_text().splitlines()
    named = [event["text"] for event in map(json.loads, lines) if event["kind"] == "renderer"]
    return report.log_sha256, named


@pytest.mark.skipif("reason()", reason="OpenGL on EGL cannot be used here")
def test_opengl_is_in_the_event_log_and_so_in_its_hash(tmp_path):
    default, unnamed = run(tmp_path, "")
    used, named = run(tmp_path, "auto")
    assert unnamed == []  # the software renderer is the default
    assert len(named) == 1
    assert named[0].startswith("camera: pictures are drawn by OpenGL, ")
    assert used != default
