"""Messages about the state of the vehicle: heartbeat, sensors, battery, version."""

from __future__ import annotations

from time import time  # noqa: TID251 - SYSTEM_TIME carries the time of day
from typing import Any

from pymavlink.dialects.v20 import all as mav

from stack.telemetry.mavlink.geography import Geography
from stack.telemetry.mavlink.modes import Mode, is_armed
from stack.telemetry.mavlink.motion import milliseconds
from stack.telemetry.records import MissionState, Snapshot
from stack.types import Battery

LOW_CHARGE, CRITICAL_CHARGE = 0.2, 0.1
_UNKNOWN_TEMPERATURE, _UNKNOWN_CELL = 32767, 65535
NO_VOLTAGE = 65535

CAPABILITIES = (
    mav.MAV_PROTOCOL_CAPABILITY_MISSION_INT
    | mav.MAV_PROTOCOL_CAPABILITY_COMMAND_INT
    | mav.MAV_PROTOCOL_CAPABILITY_PARAM_FLOAT
    | mav.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_C_CAST
    | mav.MAV_PROTOCOL_CAPABILITY_MAVLINK2
    | mav.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_LOCAL_NED
    | mav.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_GLOBAL_INT
)

_HARDWARE = mav.MAV_SYS_STATUS_SENSOR_BATTERY | mav.MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS
_INERTIAL = mav.MAV_SYS_STATUS_SENSOR_3D_GYRO | mav.MAV_SYS_STATUS_SENSOR_3D_ACCEL
_POSITION = mav.MAV_SYS_STATUS_SENSOR_VISION_POSITION | mav.MAV_SYS_STATUS_SENSOR_LASER_POSITION
"""MAVLink's bits for a position from scan matching and markers; there is no GPS and no compass."""


def heartbeat(snapshot: Snapshot | None, mode: Mode) -> Any:
    """HEARTBEAT of a ground rover with ArduRover's modes."""
    flags = mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
    armed = is_armed(snapshot)
    if armed:
        flags |= mav.MAV_MODE_FLAG_SAFETY_ARMED
    if mode in (Mode.AUTO, Mode.GUIDED, Mode.RTL):
        flags |= mav.MAV_MODE_FLAG_GUIDED_ENABLED
    if mode is Mode.MANUAL:
        flags |= mav.MAV_MODE_FLAG_MANUAL_INPUT_ENABLED
    return mav.MAVLink_heartbeat_message(
        mav.MAV_TYPE_GROUND_ROVER, mav.MAV_AUTOPILOT_ARDUPILOTMEGA, flags, int(mode),
        _state(snapshot, armed), 3,
    )  # fmt: skip


def _state(snapshot: Snapshot | None, armed: bool) -> int:
    if snapshot is None or snapshot.state is MissionState.STARTING:
        return int(mav.MAV_STATE_BOOT)
    if snapshot.state is MissionState.EMERGENCY_STOP:
        return int(mav.MAV_STATE_CRITICAL)
    return int(mav.MAV_STATE_ACTIVE if armed else mav.MAV_STATE_STANDBY)


def system_status(snapshot: Snapshot, geography: Geography) -> Any:
    """SYS_STATUS. Without the geofence bit MAVProxy reports a fence breach.

    The IMU's bits stand only for a robot with one; they are healthy while it delivers. The bits of
    position are healthy while the robot is not lost, that of arming checks while it may be armed.
    """
    imu = [sensor for sensor in snapshot.sensors if "imu" in sensor.name]
    present = _HARDWARE | _POSITION | mav.MAV_SYS_STATUS_GEOFENCE | mav.MAV_SYS_STATUS_PREARM_CHECK
    present |= _INERTIAL if imu else 0
    healthy = present
    if any(sensor.is_slow for sensor in imu):
        healthy &= ~_INERTIAL
    if snapshot.health < snapshot.health_thresholds.lost:
        healthy &= ~_POSITION
    if snapshot.state.is_over or snapshot.state is MissionState.STARTING:
        healthy &= ~mav.MAV_SYS_STATUS_PREARM_CHECK
    battery = snapshot.battery
    return mav.MAVLink_sys_status_message(
        present, present, healthy, _load(snapshot), _millivolts(battery), -1, _percent(battery),
        0, 0, 0, 0, 0, 0,
    )  # fmt: skip


def _load(snapshot: Snapshot) -> int:
    """Compute time of the loop in per mille of its period."""
    spent = sum(stage.mean for name, stage in snapshot.stages.items() if name != "step")
    budgets = [stage.budget for stage in snapshot.stages.values() if stage.budget > 0.0]
    return min(1000, round(1000.0 * spent / max(budgets))) if budgets else 0


def battery_status(snapshot: Snapshot, geography: Geography) -> Any:
    """BATTERY_STATUS."""
    battery = snapshot.battery
    if battery.charging:
        state = mav.MAV_BATTERY_CHARGE_STATE_CHARGING
    elif battery.charge < CRITICAL_CHARGE:
        state = mav.MAV_BATTERY_CHARGE_STATE_CRITICAL
    elif battery.charge < LOW_CHARGE:
        state = mav.MAV_BATTERY_CHARGE_STATE_LOW
    else:
        state = mav.MAV_BATTERY_CHARGE_STATE_OK
    return mav.MAVLink_battery_status_message(
        0, mav.MAV_BATTERY_FUNCTION_ALL, mav.MAV_BATTERY_TYPE_UNKNOWN,
        _UNKNOWN_TEMPERATURE, [_millivolts(battery), *[_UNKNOWN_CELL] * 9], -1, -1, -1,
        _percent(battery), 0, state,
    )  # fmt: skip


def extended_state(snapshot: Snapshot, geography: Geography) -> Any:
    """EXTENDED_SYS_STATE: always on the ground."""
    return mav.MAVLink_extended_sys_state_message(
        mav.MAV_VTOL_STATE_UNDEFINED, mav.MAV_LANDED_STATE_ON_GROUND
    )


def system_time(snapshot: Snapshot, geography: Geography) -> Any:
    """SYSTEM_TIME: the time of day, and the robot's clock."""
    return mav.MAVLink_system_time_message(round(time() * 1e6), milliseconds(snapshot))


def autopilot_version(identity: str) -> Any:
    """AUTOPILOT_VERSION.

    Args:
        identity: of the run, hexadecimal; the unique id of the vehicle for this run.
    """
    from importlib.metadata import PackageNotFoundError, version

    try:
        numbers = [int(part) for part in version("treepilot").split(".")[:3] if part.isdecimal()]
    except PackageNotFoundError:
        numbers = []
    major, minor, patch = (*numbers, 0, 0, 0)[:3]
    software = (major & 255) << 24 | (minor & 255) << 16 | (patch & 255) << 8
    digits = identity if all(c in "0123456789abcdef" for c in identity) else ""
    return mav.MAVLink_autopilot_version_message(
        CAPABILITIES, software, 0, 0, 0, bytes(8), bytes(8), bytes(8), 0, 0,
        int(digits[:16] or "0", 16),
    )  # fmt: skip


def _millivolts(battery: Battery) -> int:
    return min(max(round(battery.voltage * 1000.0), 0), NO_VOLTAGE - 1)


def _percent(battery: Battery) -> int:
    return min(max(round(battery.charge * 100.0), 0), 100)
