"""The vehicle on a real link: UDP of this machine, in a thread of its own."""

import os
import socket
from time import monotonic, sleep  # noqa: TID251 - the link lives in wall time

import pytest
from pymavlink.dialects.v20 import all as mav

from missions.execution.connections import network_sinks_of
from missions.run_options import RunOptions
from stack.errors import InputError
from stack.mavlink.address import read_address
from stack.mavlink.link import Link
from stack.mavlink.signing import Signing, make_key, read_key, signed_codecs
from stack.telemetry.hub import Telemetry
from stack.telemetry.mavlink.sink import MavlinkVehicle
from stack.telemetry.records import Ack, MissionState
from tests.missions.execution.lossy_relay import free_port
from tests.stack.telemetry.conftest import make_snapshot

LIMIT = 5.0
"""Wall seconds to wait for what must come."""

DISARM = (1, 1, 400, 0, 0, 0, 0, 0, 0, 0, 0)


class Station:
    """A ground station on a link of its own."""

    def __init__(self, address, key=None):
        codecs = None if key is None else signed_codecs(Signing(key, link_id=7))
        self.link = Link(read_address(address), system=255, component=190, make_codec=codecs)

    def get(self, kind, within=LIMIT):
        """The next message of a kind; None if none comes in time."""
        end = monotonic() + within
        while monotonic() < end:
            for received in self.link.receive(0.02):
                if received.kind == kind:
                    return received.message
        return None

    def disarm(self):
        self.link.send(mav.MAVLink_command_long_message(*DISARM))

    def beat(self):
        self.link.send(mav.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))


@pytest.fixture
def opened(info):
    """opened(address, …): the telemetry of a run with a vehicle at this address."""
    runs = []

    def open_(address, **options):
        log = []
        runs.append((Telemetry(info, [MavlinkVehicle(address, **options)], log.append), log))
        return runs[-1]

    yield open_
    for telemetry, _ in runs:
        telemetry.close(None)


def commands_of(telemetry, within=LIMIT):
    """The commands that come in, acknowledged and published as the engine does."""
    end = monotonic() + within
    while monotonic() < end:
        telemetry.publish(make_snapshot)
        commands = telemetry.commands()
        for command in commands:
            telemetry.acknowledge(Ack(command.id, True))
        telemetry.publish(lambda: make_snapshot(state=MissionState.EMERGENCY_STOP))
        if commands:
            return commands
        sleep(0.01)
    return []


def test_heartbeats_and_answers_come_while_the_engine_does_nothing(opened):
    port = free_port()
    station = Station(f"udpin:127.0.0.1:{port}")
    opened(f"udpout:127.0.0.1:{port}")
    assert station.get("HEARTBEAT").custom_mode == 16  # initialising
    station.link.send(mav.MAVLink_command_long_message(1, 1, 31000, 0, *[0] * 7))
    assert station.get("COMMAND_ACK").result == 3
    assert station.get("HEARTBEAT") is not None
    station.link.close()


def test_an_ack_comes_with_the_state_that_it_has_changed(opened):
    port = free_port()
    telemetry, _ = opened(f"udpin:127.0.0.1:{port}")
    station = Station(f"udpout:127.0.0.1:{port}")
    telemetry.publish(make_snapshot)
    station.beat()
    station.disarm()
    (command,) = commands_of(telemetry)
    assert (command.kind, command.arguments) == ("estop", {
        "reason": "disarmed by station 255/190",
    })  # fmt: skip
    assert station.get("COMMAND_ACK").result == 0
    station.link.close()


def test_a_signed_vehicle_obeys_only_its_key(opened, tmp_path):
    key, other = tmp_path / "robot.key", tmp_path / "other.key"
    make_key(key)
    make_key(other)
    port = free_port()
    telemetry, _ = opened(f"udpin:0.0.0.0:{port}", key=key)
    stations = [Station(f"udpout:127.0.0.1:{port}", secret)
                for secret in (None, read_key(other), read_key(key))]  # fmt: skip
    for station in stations[:2]:
        station.disarm()
        assert commands_of(telemetry, 0.3) == []
    stations[2].disarm()
    assert [command.kind for command in commands_of(telemetry)] == ["estop"]
    assert stations[2].get("COMMAND_ACK").result == 0
    for station in stations:
        station.link.close()
    telemetry.close(None)
    assert (tmp_path / "robot.key.stamp").exists()


def test_a_serial_link_ends_when_the_device_is_gone(opened):
    pytest.importorskip("serial")
    far, near = os.openpty()
    telemetry, log = opened(f"serial:{os.ttyname(near)}")
    assert os.read(far, 1)[0] == 0xFD
    os.close(near)
    os.close(far)
    end = monotonic() + LIMIT
    while not log and monotonic() < end:
        telemetry.publish(make_snapshot)
        sleep(0.01)
    assert len(log) == 1 and "MavlinkVehicle failed" in log[0]
    assert [event.kind for event in telemetry.recent(1)] == ["link_lost"]


def test_a_key_needs_a_link(tmp_path):
    with pytest.raises(InputError, match="--mavlink, which is not given"):
        network_sinks_of(RunOptions(mavlink_key=tmp_path / "robot.key", serve=False))


def test_a_link_that_cannot_be_opened_is_an_error_of_the_user(tmp_path):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        with pytest.raises(InputError, match="Address already in use"):
            MavlinkVehicle(f"udpin:127.0.0.1:{taken.getsockname()[1]}")
    with pytest.raises(InputError, match="would listen on 0"):
        MavlinkVehicle("udpin:0.0.0.0:14550")
    with pytest.raises(InputError, match="No such file"):
        MavlinkVehicle("udpin:127.0.0.1:14550", key=tmp_path / "none")
