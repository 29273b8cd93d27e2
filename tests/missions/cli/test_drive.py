"""`treepilot drive --map`: keys become velocities, and the map is saved at the end."""

import pytest
from typer.testing import CliRunner

from missions.cli.app import app
from missions.cli.running.drive import keys_in, mission_text, press, velocity_of
from missions.execution.prepare import prepare
from missions.execution.run import Run
from missions.run_options import RunOptions


@pytest.mark.parametrize(
    ("key", "velocity"),
    [("w", {"linear": 0.3}), ("\x1b[D", {"angular": 0.8}), ("e", {"lateral": -0.2}), ("k", None)],
)
def test_keys_are_velocities(key, velocity):
    assert velocity_of(key) == velocity


def test_arrows_are_single_keys():
    assert keys_in("w\x1b[A\x1b[Cx") == ["w", "\x1b[A", "\x1b[C", "x"]


def test_a_drive_by_keys_saves_its_map(tmp_path):
    file = tmp_path / "drive.yaml"
    file.write_text(mission_text("scout", "small_room", mapping=True))
    options = RunOptions(out=tmp_path / "run", serve=False)
    run = Run(prepare(file, options), options)
    try:
        for step in range(2000):
            if run.is_over:
                break
            run.step()
            time = run.engine.body.time
            if 2.5 < time < 5.0 and step % 8 == 0:
                press(run, "w")
            if time > 5.5:
                press(run, "x")
        report = run.finish()
    finally:
        run.close()
    assert report.status == "success", report.reason
    assert report.final_pose["truth"]["x"] > 1.4  # 0.3 m/s for 2.5 s from x = 1
    assert (tmp_path / "run/map/map.yaml").exists()


def test_drive_needs_a_terminal():
    result = CliRunner().invoke(app, ["drive", "--map"])
    assert result.exit_code != 0
    assert "needs a terminal" in str(result.exception)
