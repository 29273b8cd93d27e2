"""What the vehicle tells about itself."""

from math import pi

import numpy as np
import pytest
from pymavlink import mavutil
from pymavlink.dialects.v20 import all as mav

from stack.mavlink.origin import GeoOrigin
from stack.telemetry.mavlink.motion import NO_BEAM, sector_distances
from stack.telemetry.mavlink.streams import STREAMS
from stack.telemetry.records import MissionState
from stack.types import Battery, Pose2D, Scan, SensorState, Twist
from tests.stack.telemetry.mavlink.conftest import Rig, of


def newest(rig, kind):
    rig.sent.clear()
    return of(rig.go_on(2.1), kind)[-1]


def test_rates(rig):
    rig.sent.clear()
    rig.go_on(10.0)
    counts = {number: 0 for number in STREAMS}
    for message in rig.sent:
        counts[message.get_msgId()] = counts.get(message.get_msgId(), 0) + 1
    for number, (_, rate) in STREAMS.items():
        assert counts[number] == pytest.approx(10 * rate, abs=1), number
    assert counts[mav.MAVLINK_MSG_ID_HEARTBEAT] == pytest.approx(10, abs=1)
    assert counts[mav.MAVLINK_MSG_ID_MISSION_CURRENT] == pytest.approx(10, abs=1)


def test_it_is_a_rover_of_ardupilot(rig):
    beat = newest(rig, "HEARTBEAT")
    assert beat.type == mav.MAV_TYPE_GROUND_ROVER
    assert beat.autopilot == mav.MAV_AUTOPILOT_ARDUPILOTMEGA
    assert mavutil.mode_string_v10(beat) == "AUTO"


@pytest.mark.parametrize(
    ("state", "mode", "status"),
    [
        (MissionState.STARTING, "INITIALISING", mav.MAV_STATE_BOOT),
        (MissionState.PAUSED, "HOLD", mav.MAV_STATE_ACTIVE),
        (MissionState.EMERGENCY_STOP, "HOLD", mav.MAV_STATE_CRITICAL),
        (MissionState.SUCCESS, "HOLD", mav.MAV_STATE_STANDBY),
    ],
)
def test_states_are_modes(rig, state, mode, status):
    rig.show(state=state)
    beat = newest(rig, "HEARTBEAT")
    assert mavutil.mode_string_v10(beat) == mode and beat.system_status == status


def test_north_east_down(rig):
    # Facing west (180 degrees), 1 m/s forward, turning left: to the east -1 m/s, to the north 0.
    rig.show(pose=Pose2D(3.0, 7.0, pi), measured=Twist(1.0, 0.5), time=2.5)
    place, attitude = newest(rig, "LOCAL_POSITION_NED"), newest(rig, "ATTITUDE")
    assert (place.x, place.y, place.z, place.time_boot_ms) == (7.0, 3.0, 0.0, 2500)
    assert (place.vx, place.vy) == pytest.approx((0.0, -1.0), abs=1e-6)
    assert attitude.yaw == pytest.approx(-pi / 2) and attitude.yawspeed == -0.5
    on_earth = newest(rig, "GLOBAL_POSITION_INT")
    assert (on_earth.vx, on_earth.vy, on_earth.hdg) == (0, -100, 27000)
    odometry = newest(rig, "ODOMETRY")
    assert (odometry.x, odometry.y, odometry.vx, odometry.yawspeed) == (7.0, 3.0, 1.0, -0.5)
    assert (odometry.pose_covariance[0], odometry.pose_covariance[6]) == (0.02, 0.01)  # y, x


def test_a_map_may_be_turned(clock):
    """East is the map's +y: 7 m along y are 7 m to the east, and 3 m along x are to the south."""
    rig = Rig(clock, origin=GeoOrigin(48.0, 11.0, 500.0, east=pi / 2))
    rig.show(pose=Pose2D(3.0, 7.0, pi / 2))
    place, attitude = newest(rig, "LOCAL_POSITION_NED"), newest(rig, "ATTITUDE")
    assert (place.x, place.y) == pytest.approx((-3.0, 7.0), abs=1e-6)
    assert attitude.yaw == pytest.approx(pi / 2)  # to the east
    on_earth = newest(rig, "GLOBAL_POSITION_INT")
    assert on_earth.lat < 480000000 and on_earth.lon > 110000000 and on_earth.alt == 500_000


def test_there_is_no_gps_and_it_says_so(rig):
    assert newest(rig, "GPS_RAW_INT").fix_type == mav.GPS_FIX_TYPE_NO_GPS
    status = newest(rig, "SYS_STATUS")
    assert not status.onboard_control_sensors_present & mav.MAV_SYS_STATUS_SENSOR_GPS


def bits(rig):
    status = newest(rig, "SYS_STATUS")
    return status.onboard_control_sensors_present, status.onboard_control_sensors_health


def test_sensors_are_told_as_they_are(rig):
    gyro, position = mav.MAV_SYS_STATUS_SENSOR_3D_GYRO, mav.MAV_SYS_STATUS_SENSOR_VISION_POSITION
    present, healthy = bits(rig)
    assert not present & gyro and healthy & position
    rig.show(sensors=(SensorState("imu", 100.0, 100.0, 0.0),))
    assert all(value & gyro for value in bits(rig))
    rig.show(sensors=(SensorState("imu", 10.0, 100.0, 0.0),), health=0.1)
    present, healthy = bits(rig)
    assert present & gyro and not healthy & gyro
    assert present & position and not healthy & position  # lost
    prearm = mav.MAV_SYS_STATUS_PREARM_CHECK
    assert healthy & prearm and healthy & mav.MAV_SYS_STATUS_GEOFENCE
    rig.show(state=MissionState.FAILURE)
    assert not bits(rig)[1] & prearm


def test_battery(rig):
    rig.show(battery=Battery(0.15, voltage=23.5))
    status, battery = newest(rig, "SYS_STATUS"), newest(rig, "BATTERY_STATUS")
    assert (status.voltage_battery, status.battery_remaining) == (23500, 15)
    assert (battery.voltages[0], battery.battery_remaining) == (23500, 15)
    assert battery.charge_state == mav.MAV_BATTERY_CHARGE_STATE_LOW


def test_obstacles_clockwise_from_ahead():
    """Four beams: ahead 2 m, left 1 m, behind nothing, right invalid; the lidar is 0.5 m ahead."""
    ranges = np.array([2.0, 1.0, np.inf, np.nan], np.float32)
    scan = Scan(0.0, ranges, 0.0, pi / 2, 0.1, 12.0, mount=Pose2D(0.5, 0.0))
    distances = sector_distances(scan)
    assert distances[0] == 250
    # (0.5, 1.0) from the base: 112 cm at 63.4 degrees to the left, sector 72 - 13
    assert distances[72 - 13] == 112
    assert distances[36] == 1201  # the largest range + 1: nothing seen
    assert distances[18] == NO_BEAM and distances.count(NO_BEAM) == 69


def test_clocks_pings_and_files(rig):
    (answer,) = of(rig.say(mav.MAVLink_timesync_message(0, 123)), "TIMESYNC")
    assert (answer.tc1, answer.ts1) == (round(rig.clock.now * 1e9), 123)
    assert of(rig.say(mav.MAVLink_timesync_message(5, 123)), "TIMESYNC") == []
    (answer,) = of(rig.say(mav.MAVLink_ping_message(7, 3, 0, 0)), "PING")
    assert (answer.seq, answer.target_system, answer.target_component) == (3, 255, 190)
    assert of(rig.say(mav.MAVLink_ping_message(7, 3, 1, 1)), "PING") == []
    payload = bytearray(251)
    payload[:4] = (9, 0, 2, 3)  # sequence 9, session 2, list a folder
    asked = mav.MAVLink_file_transfer_protocol_message(0, 1, 1, payload)
    (answer,) = of(rig.say(asked), "FILE_TRANSFER_PROTOCOL")
    assert (answer.payload[0], answer.payload[3], answer.payload[5]) == (10, 129, 3)  # NAK


def test_a_key_over_the_air_is_refused(rig):
    sent = rig.say(mav.MAVLink_setup_signing_message(1, 1, bytes(range(32)), 0))
    text = "".join(message.text for message in of(sent, "STATUSTEXT"))
    assert "keys are set on the robot only" in text
