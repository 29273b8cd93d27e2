"""A mission drives motor drives on a CAN bus, emulated with their robot in another process."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.robots.motors.emulated_robot import robot_process

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("fast_loop")]

ROBOTS = Path(__file__).parents[3] / "robots"

BRAIN = """
mission: drive own wheels
format: 1
robot: ./robot.yaml
world: office
start: dock
run:
  sequence:
    - drive_on_heading: {distance: 1 m, speed: 0.5}
    - spin: {angle: 90 deg}
"""


def robot_file(folder, robot):
    """Write the robot file of mission 46, with the drives and the lidar of an emulated robot."""
    text = (ROBOTS / "scout_wheels" / "robot.yaml").read_text()
    text = text.replace("../scout", str(ROBOTS / "scout")).replace(
        "port: 5610", f"port: {robot.port}"
    )
    (folder / "robot.yaml").write_text(f"{text}body: {robot.body}\n")


def test_a_mission_drives_own_wheels_in_another_process(tmp_path):
    (tmp_path / "brain.yaml").write_text(BRAIN)
    out = tmp_path / "run"
    with robot_process("46_own_wheels") as robot:
        robot_file(tmp_path, robot)
        done = subprocess.run(
            [sys.executable, "-m", "treepilot", "run", tmp_path / "brain.yaml", "--headless",
             "--out", out], capture_output=True, text=True, timeout=120,
        )  # fmt: skip
        assert done.returncode == 0, done.stdout + done.stderr
        there = robot.end()
    driven = json.loads((out / "report.json").read_text())
    start = (0.8, 5.0)  # the dock of the office
    assert there["x"] - start[0] == pytest.approx(1.0, abs=0.1)
    assert there["heading"] == pytest.approx(1.571, abs=0.1)
    assert there["collisions"] == 0
    assert driven["fast_loop"]["cycles"] > 500
    pose = driven["final_pose"]["estimate"]
    assert (pose["x"], pose["y"]) == pytest.approx((there["x"], there["y"]), abs=0.1)
