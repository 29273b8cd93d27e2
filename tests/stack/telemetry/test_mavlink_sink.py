import os
import random
import socket
import sys
from math import pi

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.errors import InputError
from stack.telemetry.hub import Telemetry
from stack.telemetry.mavlink_sink import NOT_SUPPORTED, MavlinkSink, text_chunks
from stack.telemetry.records import MissionState
from stack.types import Battery, Pose2D, Twist

os.environ["MAVLINK20"] = "1"
from pymavlink import mavutil


@pytest.fixture
def station():
    """A ground station on a free port of this machine, read by pymavlink itself."""
    link = mavutil.mavlink_connection("udpin:127.0.0.1:0", dialect="ardupilotmega")
    yield link
    link.close()


def address_of(station):
    return f"udpout:127.0.0.1:{station.port.getsockname()[1]}"


def received(station):
    """All messages that have come, by type. Loopback delivers before a send returns."""
    messages = {}
    while (message := station.recv_match(blocking=False)) is not None:
        messages.setdefault(message.get_type(), []).append(message)
    return messages


@pytest.fixture
def telemetry(station, info, clock):
    dropped = []
    telemetry = Telemetry(info, [MavlinkSink(address_of(station), clock)], dropped.append)
    yield telemetry
    telemetry.close(None)
    assert dropped == []


def drive(telemetry, clock, snapshot_at, seconds, **changes):
    """Twenty steps a second, in real time."""
    for step in range(round(seconds * 20)):
        time = step / 20
        telemetry.advance(step, time)
        telemetry.publish(lambda time=time: snapshot_at(time=time, **changes))
        clock.now += 0.05


def test_rates_are_those_of_robot_time(station, telemetry, clock, snapshot_at):
    drive(telemetry, clock, snapshot_at, 10.0)
    messages = received(station)
    counts = {kind: len(found) for kind, found in messages.items()}
    assert counts["ATTITUDE"] == counts["LOCAL_POSITION_NED"] == 100
    assert counts["SYS_STATUS"] == 10 and counts["BATTERY_STATUS"] == 5
    assert 10 <= counts["HEARTBEAT"] <= 12  # one at opening, one as the mission starts to run
    assert "BAD_DATA" not in counts and messages["ATTITUDE"][0].get_msgbuf()[0] == 0xFD  # version 2


def test_it_is_a_rover_of_ardupilot(station, telemetry, clock, snapshot_at):
    drive(telemetry, clock, snapshot_at, 0.1)
    beat = received(station)["HEARTBEAT"][-1]
    assert (beat.get_srcSystem(), beat.get_srcComponent()) == (1, 1)
    assert beat.type == mavutil.mavlink.MAV_TYPE_GROUND_ROVER
    assert beat.autopilot == mavutil.mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA
    assert mavutil.mode_string_v10(beat) == "AUTO"
    assert beat.base_mode & mavutil.mavlink.MAV_MODE_FLAG_SAFETY_ARMED


@pytest.mark.parametrize(
    ("state", "mode", "armed"),
    [
        (MissionState.PAUSED, "HOLD", True),
        (MissionState.EMERGENCY_STOP, "HOLD", False),
        (MissionState.SUCCESS, "HOLD", False),
    ],
)
def test_states_are_modes(station, telemetry, clock, snapshot_at, state, mode, armed):
    drive(telemetry, clock, snapshot_at, 0.2, state=state)
    beat = received(station)["HEARTBEAT"][-1]
    assert mavutil.mode_string_v10(beat) == mode
    assert bool(beat.base_mode & mavutil.mavlink.MAV_MODE_FLAG_SAFETY_ARMED) == armed


def test_north_east_down(station, telemetry, clock, snapshot_at):
    # Facing west (180°), 1 m/s forward, turning left: south component 0, east component -1.
    pose, speed = Pose2D(3.0, 7.0, pi), Twist(1.0, 0.5)
    drive(telemetry, clock, snapshot_at, 0.05, pose=pose, measured=speed)
    messages = received(station)
    place, attitude = messages["LOCAL_POSITION_NED"][0], messages["ATTITUDE"][0]
    assert (place.x, place.y, place.z) == (7.0, 3.0, 0.0)
    assert (place.vx, place.vy) == pytest.approx((0.0, -1.0), abs=1e-6)
    assert attitude.yaw == pytest.approx(-pi / 2) and attitude.yawspeed == -0.5


def test_battery_and_health(station, telemetry, clock, snapshot_at):
    lost = {"battery": Battery(0.15, voltage=23.5), "health": 0.1}
    drive(telemetry, clock, snapshot_at, 0.05, **lost)
    messages = received(station)
    status, battery = messages["SYS_STATUS"][0], messages["BATTERY_STATUS"][0]
    assert (status.voltage_battery, status.battery_remaining) == (23500, 15)
    assert (battery.voltages[0], battery.battery_remaining) == (23500, 15)
    assert battery.charge_state == mavutil.mavlink.MAV_BATTERY_CHARGE_STATE_LOW
    laser = mavutil.mavlink.MAV_SYS_STATUS_SENSOR_LASER_POSITION
    gps = mavutil.mavlink.MAV_SYS_STATUS_SENSOR_GPS
    present, healthy = (
        status.onboard_control_sensors_present,
        status.onboard_control_sensors_health,
    )
    assert present & laser and not healthy & laser and not present & gps


def test_warnings_and_texts_of_the_mission_are_sent(station, telemetry):
    telemetry.emit("node_status", "not for the station", source="tree")
    telemetry.emit("say", "hello", source="mission")
    long = "The way to the meeting room is blocked by something 1.2 m ahead: planning again"
    telemetry.emit("replan", long, source="navigation", level="warning")
    texts = received(station)["STATUSTEXT"]
    assert (texts[0].text, texts[0].severity, texts[0].id) == ("hello", 6, 0)
    assert "".join(piece.text for piece in texts[1:]) == long
    assert {piece.id for piece in texts[1:]} == {1}
    assert [piece.chunk_seq for piece in texts[1:]] == [0, 1]


def test_the_link_stays_alive_while_robot_time_stands_still(station, telemetry, clock, snapshot_at):
    drive(telemetry, clock, snapshot_at, 0.1)
    received(station)
    for _ in range(50):
        telemetry.publish(snapshot_at)
        clock.now += 0.1
    messages = received(station)
    assert messages.keys() == {"HEARTBEAT"} and 4 <= len(messages["HEARTBEAT"]) <= 6


def test_a_station_that_connects_is_served(info, clock, snapshot_at):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    telemetry = Telemetry(info, [MavlinkSink(f"udp:127.0.0.1:{port}", clock)])
    caller = mavutil.mavlink_connection(f"udpout:127.0.0.1:{port}", dialect="ardupilotmega")
    caller.mav.heartbeat_send(6, 8, 0, 0, 4)
    drive(telemetry, clock, snapshot_at, 1.0)
    assert len(received(caller)["ATTITUDE"]) >= 9
    caller.close()
    telemetry.close(None)


@pytest.fixture
def asked(station, telemetry, clock, snapshot_at):
    """Sends a message of the station's as bytes of MAVLink; returns the answers."""
    drive(telemetry, clock, snapshot_at, 0.1)
    received(station)

    def ask(message):
        station.mav.send(message)
        clock.now += 0.11
        telemetry.publish(snapshot_at)
        return received(station)

    return ask


LINK = mavutil.mavlink
COMMANDS = [
    LINK.MAVLink_command_long_message(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0),  # arm
    LINK.MAVLink_command_long_message(1, 0, 176, 3, 1, 10, 0, 0, 0, 0, 0),  # set the mode, repeated
    LINK.MAVLink_command_long_message(0, 0, 512, 0, 148, 0, 0, 0, 0, 0, 0),  # who are you, to all
    LINK.MAVLink_command_long_message(1, 1, 65535, 0, float("nan"), 0, 0, 0, 0, 0, 0),
    LINK.MAVLink_command_int_message(1, 1, 0, 192, 0, 0, 0, 1, 0, 0, 1, 1, 0),  # drive there
]


@pytest.mark.parametrize("command", COMMANDS)
def test_commands_are_answered_as_unsupported(asked, command):
    (ack,) = asked(command)["COMMAND_ACK"]
    assert (ack.command, ack.result) == (command.command, LINK.MAV_RESULT_UNSUPPORTED)
    assert (ack.target_system, ack.target_component) == (255, 0)  # pymavlink's own


def test_modes_missions_and_parameters_are_answered_as_unsupported(asked):
    answers = asked(LINK.MAVLink_set_mode_message(1, 1, 10))
    (ack,) = answers["COMMAND_ACK"]
    assert (ack.command, ack.result) == (11, LINK.MAV_RESULT_UNSUPPORTED)  # as ArduPilot's
    assert "accepts no commands" in answers["STATUSTEXT"][0].text
    for message in (
        LINK.MAVLink_mission_count_message(1, 1, 5, 0),
        LINK.MAVLink_mission_request_list_message(1, 1, 1),
        LINK.MAVLink_mission_clear_all_message(1, 0, 2),
        LINK.MAVLink_mission_set_current_message(1, 1, 3),
        LINK.MAVLink_mission_item_int_message(1, 1, 0, 0, 16, 1, 1, 0, 0, 0, 0, 1, 1, 0),
    ):
        (ack,) = asked(message)["MISSION_ACK"]
        assert ack.type == LINK.MAV_MISSION_UNSUPPORTED
        assert ack.mission_type == message.to_dict().get("mission_type", 0)
    for message in (
        LINK.MAVLink_param_request_list_message(1, 1),
        LINK.MAVLink_param_set_message(1, 1, b"SPEED", 1.0, 9),
    ):
        assert asked(message).keys() <= {"HEARTBEAT"}  # told once, in words


def test_the_first_request_for_parameters_is_answered_in_words(asked):
    texts = asked(LINK.MAVLink_param_request_list_message(1, 1))["STATUSTEXT"]
    assert "".join(text.text for text in texts) == NOT_SUPPORTED


@pytest.mark.parametrize(
    "message",
    [
        LINK.MAVLink_command_long_message(2, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0),  # to another system
        LINK.MAVLink_command_long_message(1, 100, 400, 0, 1, 0, 0, 0, 0, 0, 0),  # to a camera
        LINK.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3),
        LINK.MAVLink_command_ack_message(400, 0, 0, 0, 1, 1),
    ],
)
def test_what_is_not_for_the_robot_is_not_answered(asked, message):
    assert asked(message).keys() <= {"HEARTBEAT"}


def test_noise_does_not_end_the_link(station, asked):
    """The fixture `telemetry` asserts that the sink was not removed."""
    chance = random.Random(3)
    whole = bytearray(COMMANDS[0].pack(station.mav))
    for number in range(300):
        noise = bytearray(chance.randbytes(chance.randrange(1, 300)))
        if number % 2:
            noise = bytearray(whole)
            noise[chance.randrange(len(noise))] ^= 1 << chance.randrange(8)
        station.write(bytes(noise))
        asked(LINK.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
    station.write(b"\0" * 300)  # ends a frame that noise began
    asked(LINK.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
    assert "COMMAND_ACK" in asked(COMMANDS[0])


def test_commands_are_answered_while_robot_time_stands_still(
    station, telemetry, clock, snapshot_at
):
    drive(telemetry, clock, snapshot_at, 0.05)
    received(station)
    for _ in range(3):
        clock.now += 0.11
        telemetry.publish(lambda: pytest.fail("no snapshot is due"))
        station.mav.send(COMMANDS[0])
    assert len(received(station)["COMMAND_ACK"]) == 2


def test_a_link_that_cannot_be_opened_is_an_error_of_the_user(monkeypatch, tmp_path):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        address = f"udp:127.0.0.1:{taken.getsockname()[1]}"
        with pytest.raises(InputError, match=f"{address}' cannot be opened: Address already in"):
            MavlinkSink(address)
    with pytest.raises(InputError, match="cannot be opened: "):
        MavlinkSink("udpout:no-such-host.invalid:14550")
    with pytest.raises(InputError, match="cannot be opened: No such file or directory"):
        MavlinkSink("serial:/dev/tty_of_nobody")
    for file in ("/dev/../bin/sh", "/dev/../etc/passwd"):  # pymavlink would execute or replay it
        with pytest.raises(InputError, match="is not a serial device"):
            MavlinkSink(f"serial:{file}")
    monkeypatch.setitem(sys.modules, "serial", None)
    sentence = (
        r"needs the Python package serial, which is not installed; "
        r"install it: pip install 'treepilot\[serial\]'"
    )
    with pytest.raises(InputError, match=sentence):
        MavlinkSink("serial:/dev/null")


def test_a_serial_link_sends_and_ends_when_the_device_is_gone(info, clock, snapshot_at):
    pytest.importorskip("serial")
    far, near = os.openpty()
    dropped = []
    telemetry = Telemetry(info, [MavlinkSink(f"serial:{os.ttyname(near)}", clock)], dropped.append)
    drive(telemetry, clock, snapshot_at, 0.1)
    assert os.read(far, 1)[0] == 0xFD
    os.close(near)
    os.close(far)
    drive(telemetry, clock, snapshot_at, 1.5)
    assert len(dropped) == 1
    telemetry.close(None)


@pytest.mark.parametrize("text", ["", "14550", "udp:0.0.0.0:14550", "serial:/etc/passwd"])
def test_wrong_addresses_are_refused(text):
    with pytest.raises(InputError, match="MAVLink address"):
        MavlinkSink(text)


@settings(deadline=None, max_examples=200)
@given(st.text(st.characters(exclude_categories=["Cs"]), max_size=120))
def test_chunks_of_a_text_join_to_the_text(text):
    pieces = list(text_chunks(text))
    assert b"".join(pieces).decode() == " ".join(text.split())
    assert all(len(piece) <= 50 for piece in pieces)
    assert len(pieces) == 1 or len(pieces[-1]) < 50


def test_a_long_text_is_truncated():
    pieces = list(text_chunks("ü" * 1000))
    assert len(pieces) == 8 and len(pieces[-1]) == 48
