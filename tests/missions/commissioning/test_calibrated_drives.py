"""Whole calibrations in simulation with slip and noise: 2 of the 20 seeds of the benchmark."""

import pytest
from typer.testing import CliRunner

from missions.cli.app import app
from missions.commissioning.odometry import DriveLimits
from robots.load import read_robot
from tests.benchmarks.calibration import odometry_trial


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1])
def test_wrong_radii_and_track_are_found(seed):
    """Drives of two minutes: stated to 0.4 %; three deviations of that."""
    trial = odometry_trial("scout", seed, DriveLimits(0.005, 150.0), slip=0.005)
    assert min(map(abs, trial.before)) > 0.029
    assert max(trial.stated) < 0.005
    for error, stated in zip(trial.after, trial.stated, strict=True):
        assert abs(error) < 3.0 * stated


@pytest.mark.slow
def test_the_command_writes_the_robot_file_and_keeps_its_layout(tmp_path):
    source = read_robot_text()
    folder = tmp_path / "rover"
    folder.mkdir()
    (folder / "scout.urdf").write_text(source[1])
    wrong = source[0].replace("robot: scout", "robot: rover\nactual: scout", 1)
    wrong = wrong.replace("separation: 29 cm", "separation: 30 cm   # by ruler")
    file = folder / "robot.yaml"
    file.write_text(wrong)
    words = ["calibrate", "odometry", str(folder), "--time", "60 s"]
    short = CliRunner().invoke(app, [*words, "--start", "0.5,0.5,0"])
    assert short.exit_code != 0 and file.read_text() == wrong
    assert "needs a free area of" in str(short.exception)
    written = CliRunner().invoke(app, words)
    assert written.exit_code in (0, 1), written.output
    text = file.read_text()
    assert "separation: 30 cm   # by ruler\n" in text
    for line in wrong.splitlines():
        assert line in text.splitlines()
    assert read_robot(file).drivetrain.radii[0] == pytest.approx(0.075, rel=0.03)


def read_robot_text():
    from pathlib import Path

    import robots

    folder = Path(robots.__file__).parent / "scout"
    return (folder / "robot.yaml").read_text(), (folder / "scout.urdf").read_text()
