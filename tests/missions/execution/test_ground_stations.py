"""MAVProxy and MAVSDK drive mission 44, over a link that loses nothing at first, then 20 %."""

from __future__ import annotations

import asyncio
import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from shutil import which
from time import monotonic, sleep  # noqa: TID251 - stations live in wall time

import pytest
import yaml

from stack.mavlink.origin import GeoOrigin
from tests.missions.execution.lossy_relay import LossyRelay, free_port

ROOT = Path(__file__).parents[3]
ORIGIN = GeoOrigin(48.1374, 11.5755, 520.0)
"""As in the world file."""

HOME = (0.8, 5.0)
PLACES = [(2.0, 5.0), (3.2, 5.4), (2.4, 4.8)]
"""In the corridor of the office, metres on the map."""

PATIENCE = 40.0
MAVPROXY = which("mavproxy.py", path=f"{Path(sys.executable).parent}:{os.environ['PATH']}")

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("ground stations")]


def wait_for(condition: Callable[[], bool], what: Callable[[], str]) -> None:
    """Wait until a condition is true; fail with a description after PATIENCE."""
    end = monotonic() + PATIENCE
    while not condition():
        assert monotonic() < end, what()
        sleep(0.05)


class VehicleRun:
    """Mission 44 in a process of its own, whose link goes through a lossy relay.

    Attributes:
        port: at which the station listens.
    """

    def __init__(self, folder: Path) -> None:
        self.folder, self.port = folder / "run", free_port()
        world = yaml.safe_load((ROOT / "missions/worlds/office.yaml").read_text("utf-8"))
        del world["people"]  # who may hold the robot up for longer than a station waits
        (folder / "empty_office.yaml").write_text(yaml.safe_dump(world), "utf-8")
        self.relay = LossyRelay(self.port)
        address = f"udpout:127.0.0.1:{self.relay.port}"
        words = ["run", "44_ground_station", "--headless", "--speed", "4"]
        self.process = subprocess.Popen(
            [sys.executable, "-m", "treepilot", *words, "--seed", "1", "--mavlink", address,
             "--world", str(folder / "empty_office.yaml"), "--out", str(self.folder)],
            cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip

    def events(self, kind: str) -> list[dict]:
        file = self.folder / "events.jsonl"
        lines = file.read_text("utf-8").splitlines() if file.exists() else []
        found = [json.loads(line) for line in lines if line.endswith("}")]
        return [event for event in found if event["kind"] == kind]

    def position(self) -> tuple[float, float]:
        pose = self.events("pose")[-1]["fields"]
        return pose["x"], pose["y"]

    def is_at(self, x: float, y: float) -> bool:
        place = self.position()
        return abs(place[0] - x) < 0.3 and abs(place[1] - y) < 0.3

    def end(self) -> dict:
        """End the mission; its report."""
        self.process.send_signal(signal.SIGINT)
        self.process.wait(20)
        return json.loads((self.folder / "report.json").read_text("utf-8"))

    def close(self) -> None:
        if self.process.poll() is None:
            self.process.terminate()  # SIGKILL would leave the engine to drive on alone
        self.process.wait(20)
        self.relay.close()


@pytest.fixture
def vehicle(tmp_path):
    run = VehicleRun(tmp_path)
    yield run
    run.close()


class MavProxy:
    """MAVProxy without a terminal: commands go in, its lines come out."""

    def __init__(self, folder: Path, port: int) -> None:
        self.output = folder / "mavproxy.txt"
        modules = "--default-modules=wp,param,cmdlong,mode,arm,misc,link"
        with self.output.open("w") as file:
            self.process = subprocess.Popen(
                [sys.executable, MAVPROXY, f"--master=udpin:127.0.0.1:{port}", modules,
                 f"--state-basedir={folder}", f"--logfile={folder / 'log.tlog'}"],
                cwd=folder, text=True, stdin=subprocess.PIPE, stdout=file, stderr=file,
            )  # fmt: skip

    @property
    def text(self) -> str:
        return self.output.read_text("utf-8", "replace")

    def expect(self, sentence: str, since: int = 0) -> None:
        """Wait until it has said something, after its first `since` characters."""
        wait_for(lambda: sentence in self.text[since:], lambda: f"{sentence!r} not in {self.text}")

    def type(self, command: str) -> None:
        self.process.stdin.write(f"{command}\n")
        self.process.stdin.flush()

    def do(self, command: str, sentence: str) -> None:
        """Type a command until the answer comes, as an operator does on a bad link."""
        since, end = len(self.text), monotonic() + PATIENCE
        while sentence not in self.text[since:]:
            assert monotonic() < end, f"{command}: {sentence!r} not in {self.text[since:]}"
            self.type(command)
            pause = monotonic() + 3.0
            while sentence not in self.text[since:] and monotonic() < pause:
                sleep(0.05)

    def close(self) -> None:
        self.process.kill()
        self.process.communicate()  # closes its pipes


def plan_file(folder: Path) -> Path:
    """A plan as MAVProxy and QGroundControl write it: item 0 is home."""
    lines = ["QGC WPL 110"]
    for number, place in enumerate([HOME, *PLACES]):
        latitude, longitude = ORIGIN.to_geodetic(*place)
        head = [number, int(number == 0), 0 if number == 0 else 3, 16, 0, 0, 0, 0]
        lines.append("\t".join(map(str, [*head, f"{latitude:.8f}", f"{longitude:.8f}", 0, 1])))
    file = folder / "plan.txt"
    file.write_text("\n".join(lines) + "\n")
    return file


@pytest.mark.skipif(MAVPROXY is None, reason="MAVProxy is not installed (see the Makefile)")
def test_mavproxy(vehicle, tmp_path):
    station = MavProxy(tmp_path, vehicle.port)
    try:
        drive_by_mavproxy(vehicle, station, plan_file(tmp_path))
    finally:
        station.close()


def drive_by_mavproxy(vehicle: VehicleRun, station: MavProxy, plan: Path) -> None:
    station.expect("online system 1")
    station.expect("Mode AUTO")
    station.expect("parameters\n")
    for loss in (0.0, 0.2):
        vehicle.relay.loss = loss
        speed = 0.6 + loss
        change = f"param set CTL_CRUISE_SPEED {speed}\nparam show CTL_CRUISE_SPEED"
        station.do(change, f"CTL_CRUISE_SPEED {speed:f}")
        station.do(f"wp load {plan}", "MISSION_ACK: TYPE_MISSION: ACCEPTED")
        station.do("wp list", "Saved 4 waypoints")
        station.do("arm throttle", "COMPONENT_ARM_DISARM: ACCEPTED")
        known = len(station.text)
        station.do("mode AUTO", "DO_SET_MODE: ACCEPTED")
        station.expect(
            "Mode HOLD", known
        )  # at its end; a text may be lost, a heartbeat comes again
        wait_for(lambda: vehicle.is_at(*PLACES[-1]), lambda: str(vehicle.position()))
        latitude, longitude = ORIGIN.to_geodetic(*PLACES[0])
        station.do(f"guided {latitude:.7f} {longitude:.7f} 0", "DO_REPOSITION: ACCEPTED")
        wait_for(lambda: vehicle.is_at(*PLACES[0]), lambda: str(vehicle.position()))
        station.do("mode RTL", "DO_SET_MODE: ACCEPTED")
        wait_for(lambda: vehicle.is_at(*HOME), lambda: str(vehicle.position()))
        station.do("disarm", "DISARMED")
        station.do("arm throttle", "ARMED")
    speeds = [event["fields"]["value"] for event in vehicle.events("parameter")]
    assert speeds[0] == "0.6" and speeds[-1] == "0.8"
    assert vehicle.relay.lost > 50
    report = vehicle.end()
    assert report["collisions"] == 0


async def first(stream):
    """The next of a stream, at most PATIENCE later."""
    return await asyncio.wait_for(anext(stream.__aiter__()), PATIENCE)


async def until(stream, good):
    """Wait until a stream brings what is good."""

    async def watch():
        async for value in stream:
            if good(value):
                return value
        return None

    return await asyncio.wait_for(watch(), PATIENCE)


async def retried(action):
    """Repeat an action that times out, as a program does on a bad link.

    MAVSDK says BUSY until the transfer before is given up.
    """
    from mavsdk.exceptions import MavsdkError

    end = monotonic() + PATIENCE
    while True:
        try:
            return await action()
        except MavsdkError:
            if monotonic() > end:
                raise
            await asyncio.sleep(0.5)


async def drive_by_mavsdk(vehicle: VehicleRun) -> None:
    from mavsdk.asyncio import ComponentType, Configuration, Mavsdk
    from mavsdk.asyncio.plugins.action import ActionAsync
    from mavsdk.asyncio.plugins.mission import MissionAsync
    from mavsdk.asyncio.plugins.param import ParamAsync
    from mavsdk.asyncio.plugins.telemetry import TelemetryAsync

    station = Configuration.create_with_component_type(ComponentType.GROUND_STATION)
    async with Mavsdk(station) as sdk:
        await sdk.add_any_connection(f"udpin://127.0.0.1:{vehicle.port}")
        system = await sdk.first_autopilot(PATIENCE)
        assert system is not None and await system.is_connected()
        telemetry = TelemetryAsync(system)
        await check_telemetry(telemetry)
        plugins = ActionAsync(system), MissionAsync(system), ParamAsync(system), telemetry
        for loss in (0.0, 0.2):
            vehicle.relay.loss = loss
            await drive_a_round(vehicle, *plugins)


async def check_telemetry(telemetry) -> None:
    await until(
        telemetry.subscribe_health(),
        lambda now: now.is_local_position_ok and now.is_home_position_ok and now.is_armable,
    )
    health = await telemetry.health()
    assert not health.is_global_position_ok  # there is no GPS, and it says so
    position = await first(telemetry.subscribe_position())
    x, y = ORIGIN.to_local(position.latitude_deg, position.longitude_deg)
    assert (x, y) == pytest.approx(HOME, abs=0.1)
    assert (await first(telemetry.subscribe_battery())).remaining_percent > 50.0


async def drive_a_round(vehicle: VehicleRun, action, plan, param, telemetry) -> None:
    from mavsdk.plugins.mission import MissionItem, MissionPlan

    items = [
        MissionItem(*ORIGIN.to_geodetic(*place), 0.0, speed, True)
        for place, speed in zip(PLACES, (0.5, 0.6, 0.7), strict=True)
    ]
    await retried(lambda: param.set_param_float("CTL_CRUISE_SPEED", 0.55))
    got = await retried(lambda: param.get_param_float("CTL_CRUISE_SPEED"))
    assert got == pytest.approx(0.55)
    await retried(action.arm)
    await retried(lambda: plan.upload_mission(MissionPlan(items)))
    back = (await retried(plan.download_mission)).mission_items
    for sent, received in zip(items, back, strict=True):
        assert received.latitude_deg == pytest.approx(sent.latitude_deg, abs=2e-7)
        assert received.longitude_deg == pytest.approx(sent.longitude_deg, abs=2e-7)
        assert received.speed_m_s == pytest.approx(sent.speed_m_s)
    await retried(plan.start_mission)
    progress = plan.subscribe_mission_progress()
    await until(progress, lambda now: now.current >= 1 and now.total == 3)
    await retried(plan.pause_mission)
    await retried(plan.start_mission)
    await until(progress, lambda now: now.current == now.total == 3)
    assert await plan.is_mission_finished()
    goal = ORIGIN.to_geodetic(*PLACES[0])
    await retried(lambda: action.goto_location(*goal, 520.0, 0.0))
    wait_for(lambda: vehicle.is_at(*PLACES[0]), lambda: str(vehicle.position()))
    await retried(action.return_to_launch)
    wait_for(lambda: vehicle.is_at(*HOME), lambda: str(vehicle.position()))
    await retried(action.disarm)
    await until(telemetry.subscribe_armed(), lambda armed: not armed)


def test_mavsdk(vehicle):
    pytest.importorskip("mavsdk", reason="mavsdk is not installed (pip install 'treepilot[test]')")
    asyncio.run(drive_by_mavsdk(vehicle))
    assert vehicle.relay.lost > 50
    report = vehicle.end()
    assert report["collisions"] == 0
