"""Both halves of treepilot over a real MAVLink connection: one simulates a rover, one drives it."""

import json
import socket
import subprocess
import sys
from pathlib import Path
from time import monotonic, sleep  # noqa: TID251 - two programs in real time

import pytest

VEHICLE = """
mission: rover
format: 1
robot: scout
world: office
start: dock
run: {wait: {time: 10 min}}
"""

BRAIN = """
mission: drive a rover
format: 1
robot: ./robot.yaml
world: office
start: dock
run:
  sequence:
    - drive_on_heading: {distance: 1 m, speed: 0.5}
    - spin: {angle: 90 deg}
"""


@pytest.fixture
def port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def treepilot(*words, log):
    with log.open("w") as written:
        return subprocess.Popen(
            [sys.executable, "-m", "treepilot", "run", *map(str, words), "--headless"],
            stdout=written, stderr=subprocess.STDOUT,
        )  # fmt: skip


@pytest.mark.slow
def test_a_mission_drives_the_rover_that_another_run_simulates(tmp_path, port):
    (tmp_path / "vehicle.yaml").write_text(VEHICLE)
    (tmp_path / "brain.yaml").write_text(BRAIN)
    scout = Path(__file__).parents[3] / "robots" / "scout_rover" / "robot.yaml"
    text = scout.read_text().replace("../scout", str(scout.parents[1] / "scout"))
    address = f"udpin:127.0.0.1:{port}"
    (tmp_path / "robot.yaml").write_text(f"{text}body: {{use: mavlink, connect: '{address}'}}\n")
    log = tmp_path / "vehicle.log"
    vehicle = treepilot(
        tmp_path / "vehicle.yaml", "--speed", 1, "--mavlink", f"udpout:127.0.0.1:{port}",
        "--out", tmp_path / "vehicle", log=log,
    )  # fmt: skip
    try:
        end = monotonic() + 60.0
        while "wait 600.0 s left" not in log.read_text():
            assert monotonic() < end and vehicle.poll() is None, log.read_text()
            sleep(0.1)
        out = tmp_path / "brain"
        brain = treepilot(tmp_path / "brain.yaml", "--out", out, log=tmp_path / "brain.log")
        assert brain.wait(120.0) == 0, (tmp_path / "brain.log").read_text()
    finally:
        vehicle.terminate()
        vehicle.wait(30.0)
    driven = json.loads((out / "report.json").read_text())
    rover = json.loads((tmp_path / "vehicle" / "report.json").read_text())
    truth, start = rover["final_pose"]["truth"], (0.8, 5.0)
    assert truth["x"] - start[0] == pytest.approx(1.0, abs=0.15)
    assert truth["heading"] == pytest.approx(1.571, abs=0.15)
    assert rover["collisions"] == 0
    link = driven["body_link"]
    assert link["setpoints"] > 10.0 and link["rates"]["ATTITUDE"] > 10.0
    assert link["round_trip_99"] is not None and driven["fast_loop"]["cycles"] > 0
