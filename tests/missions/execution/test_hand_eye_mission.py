"""Mission 54: its recording gives the mount of the camera in the hand."""

import numpy as np
import pytest

from missions.commissioning.hand_eye_views import views_in
from missions.execution.running import run_mission
from missions.run_options import RunOptions
from robots.load import HERE, read_robot
from stack.perception.hand_eye import calibrate_hand_eye
from stack.telemetry.sensor_log import read_observations


@pytest.mark.slow
def test_a_mount_that_is_described_wrongly_is_found(tmp_path):
    """The file says 1 cm and 2 degrees off; the pictures are those of the true mount."""
    true, text = HERE / "panda_eye" / "robot.yaml", "actual: panda_eye\n"
    text += true.read_text("utf-8").replace("[6 cm, 0, 2 cm]", "[6.5 cm, 0.6 cm, 2.6 cm]")
    described = tmp_path / "robot.yaml"
    described.write_text(text.replace("-90 deg", "-88 deg"), "utf-8")
    out = tmp_path / "run"
    options = RunOptions(seed=1, out=out, robot=str(described), record=("sensors",), camera="on")
    report = run_mission("54_hand_eye", options)
    assert report.status == "success", report.reason
    seen = read_observations(out / "sensors.mcap")
    found = views_in(seen, read_robot(described), 7, 0.08, "DICT_4X4_50")
    assert len(found.views) >= 15
    result = calibrate_hand_eye(found.views, in_hand=True)
    off = np.linalg.inv(read_robot(true).camera.model.base_from_optical()) @ result.mount
    assert np.linalg.norm(off[:3, 3]) < 0.002
    assert np.degrees(np.arccos((np.trace(off[:3, :3]) - 1.0) / 2.0)) < 0.2
