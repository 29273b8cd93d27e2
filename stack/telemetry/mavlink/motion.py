"""Messages about pose, velocity, position on Earth and obstacles, from a snapshot.

Stamps are the robot's clock. The north axis is the map's y axis, turned as the origin says.
"""

from __future__ import annotations

from math import cos, degrees, hypot, isfinite, pi, sin
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymavlink.dialects.v20 import all as mav

from stack.mavlink.frames import (
    frd_covariance,
    frd_twist,
    ned_covariance,
    ned_pose,
    pack_covariance,
)
from stack.telemetry.mavlink.geography import Geography
from stack.telemetry.records import Snapshot
from stack.types import FloatArray, Pose2D, Scan

LOCAL_NED, BODY_FRD = 1, 12
LASER = 0
SECTORS = 72
"""Of OBSTACLE_DISTANCE, 5 degrees each, clockwise from straight ahead."""

NO_BEAM = 65535
UNKNOWN_16 = 65535
MAX_CENTIMETRES = 65533
VELOCITY_VARIANCE = 0.0025
"""(m/s)² and (rad/s)²: of wheel odometry, for receivers that need a number."""


def milliseconds(snapshot: Snapshot) -> int:
    """The stamp of a snapshot; it wraps after 49.7 days."""
    return round(snapshot.time * 1000.0) & 0xFFFFFFFF


def microseconds(snapshot: Snapshot) -> int:
    """The stamp of a snapshot."""
    return round(snapshot.time * 1e6)


def north_east(snapshot: Snapshot, geography: Geography) -> tuple[float, float, float, Pose2D]:
    """Velocity to the north and to the east, yaw, and the pose in east-north-up axes."""
    pose = geography.enu(snapshot.pose)
    velocity = snapshot.measured
    c, s = cos(pose.heading), sin(pose.heading)
    east = c * velocity.linear - s * velocity.lateral
    north = s * velocity.linear + c * velocity.lateral
    return north, east, ned_pose(pose.x, pose.y, pose.heading)[2], pose


def attitude(snapshot: Snapshot, geography: Geography) -> Any:
    """ATTITUDE: the robot is level."""
    yaw = north_east(snapshot, geography)[2]
    rate = -snapshot.measured.angular
    return mav.MAVLink_attitude_message(milliseconds(snapshot), 0.0, 0.0, yaw, 0.0, 0.0, rate)


def attitude_quaternion(snapshot: Snapshot, geography: Geography) -> Any:
    """ATTITUDE_QUATERNION: the same."""
    w, x, y, z = _yaw_quaternion(north_east(snapshot, geography)[2])
    rate = -snapshot.measured.angular
    return mav.MAVLink_attitude_quaternion_message(
        milliseconds(snapshot), w, x, y, z, 0.0, 0.0, rate
    )


def local_position(snapshot: Snapshot, geography: Geography) -> Any:
    """LOCAL_POSITION_NED: from the origin of the map."""
    north, east, _, pose = north_east(snapshot, geography)
    return mav.MAVLink_local_position_ned_message(
        milliseconds(snapshot), pose.y, pose.x, 0.0, north, east, 0.0
    )


def odometry(snapshot: Snapshot, geography: Geography) -> Any:
    """ODOMETRY: the estimate in LOCAL_NED, velocities in BODY_FRD, with covariances."""
    _, _, yaw, pose = north_east(snapshot, geography)
    velocity = snapshot.measured
    forward, right, rate = frd_twist(velocity.linear, velocity.lateral, velocity.angular)
    spread = np.eye(3) * VELOCITY_VARIANCE
    return mav.MAVLink_odometry_message(
        microseconds(snapshot), LOCAL_NED, BODY_FRD, pose.y, pose.x, 0.0,
        list(_yaw_quaternion(yaw)), forward, right, 0.0, 0.0, 0.0, rate,
        pack_covariance(ned_covariance(snapshot.covariance.tolist())),
        pack_covariance(frd_covariance(spread.tolist())),
        0, mav.MAV_ESTIMATOR_TYPE_VISION, max(1, round(100 * snapshot.health)),
    )  # fmt: skip


def global_position(snapshot: Snapshot, geography: Geography) -> Any:
    """GLOBAL_POSITION_INT: the estimate on Earth; None without an origin."""
    origin = geography.origin
    if origin is None:
        return None
    north, east, yaw, _ = north_east(snapshot, geography)
    latitude, longitude = origin.to_integers(snapshot.pose.x, snapshot.pose.y)
    return mav.MAVLink_global_position_int_message(
        milliseconds(snapshot), latitude, longitude, round(origin.altitude * 1000.0), 0,
        _clamped(north * 100.0), _clamped(east * 100.0), 0,
        round(degrees(yaw % (2.0 * pi)) * 100.0) % 36000,
    )  # fmt: skip


def gps_raw(snapshot: Snapshot, geography: Geography) -> Any:
    """GPS_RAW_INT: there is no receiver, so no fix; the position is that of the estimate."""
    origin = geography.origin
    if origin is None:
        return None
    latitude, longitude = origin.to_integers(snapshot.pose.x, snapshot.pose.y)
    return mav.MAVLink_gps_raw_int_message(
        microseconds(snapshot), mav.GPS_FIX_TYPE_NO_GPS, latitude, longitude,
        round(origin.altitude * 1000.0), UNKNOWN_16, UNKNOWN_16, UNKNOWN_16, UNKNOWN_16, 0,
    )  # fmt: skip


def global_origin(snapshot: Snapshot, geography: Geography) -> Any:
    """GPS_GLOBAL_ORIGIN; None without one."""
    origin = geography.origin
    if origin is None:
        return None
    return mav.MAVLink_gps_global_origin_message(
        *origin.to_integers(0.0, 0.0), round(origin.altitude * 1000.0), microseconds(snapshot)
    )


def home_position(snapshot: Snapshot, geography: Geography) -> Any:
    """HOME_POSITION; None without an origin or before the first pose."""
    origin, home = geography.origin, geography.home
    if origin is None or home is None:
        return None
    local = geography.enu(home)
    yaw = ned_pose(local.x, local.y, local.heading)[2]
    return mav.MAVLink_home_position_message(
        *origin.to_integers(home.x, home.y), round(origin.altitude * 1000.0), local.y, local.x, 0.0,
        list(_yaw_quaternion(yaw)), 0.0, 0.0, 0.0, microseconds(snapshot),
    )  # fmt: skip


def head_up_display(snapshot: Snapshot, geography: Geography) -> Any:
    """VFR_HUD."""
    speed = hypot(snapshot.measured.linear, snapshot.measured.lateral)
    yaw = north_east(snapshot, geography)[2]
    altitude = 0.0 if geography.origin is None else geography.origin.altitude
    return mav.MAVLink_vfr_hud_message(
        speed, speed, round(degrees(yaw % (2.0 * pi))) % 360, 0, altitude, 0.0
    )


def obstacle_distance(snapshot: Snapshot, geography: Geography) -> Any:
    """OBSTACLE_DISTANCE: the nearest return of the lidar in each sector; None without a scan."""
    scan = snapshot.scan
    if scan is None:
        return None
    return mav.MAVLink_obstacle_distance_message(
        round(scan.stamp * 1e6), LASER, sector_distances(scan), 360 // SECTORS,
        _centimetres(scan.range_min), _centimetres(scan.range_max), 360.0 / SECTORS, 0.0, BODY_FRD,
    )  # fmt: skip


def sector_distances(scan: Scan) -> list[int]:
    """Distances of the nearest return from the base, centimetres, by sector clockwise from ahead.

    A sector whose beams all have no return has the largest range + 1; one without a valid beam has
    NO_BEAM.
    """
    distances = np.full(SECTORS, float(NO_BEAM))
    nothing = float(_centimetres(scan.range_max) + 1)
    unseen = np.isposinf(scan.ranges)
    np.minimum.at(distances, _sectors(scan.mount.heading + scan.angles[unseen]), nothing)
    points = scan.points()
    ranges = np.clip(np.round(100.0 * np.hypot(points[:, 0], points[:, 1])), 0.0, MAX_CENTIMETRES)
    np.minimum.at(distances, _sectors(np.arctan2(points[:, 1], points[:, 0])), ranges)
    return [int(value) for value in distances]


def _sectors(bearings: FloatArray) -> NDArray[np.int64]:
    """Sector of each bearing (anticlockwise from ahead); a sector is centred on its angle."""
    clockwise = np.round(-bearings * SECTORS / (2.0 * pi)).astype(np.int64)
    return clockwise % SECTORS


def _yaw_quaternion(yaw: float) -> tuple[float, float, float, float]:
    return cos(yaw / 2.0), 0.0, 0.0, sin(yaw / 2.0)


def _clamped(value: float) -> int:
    return min(max(round(value), -32767), 32767) if isfinite(value) else 0


def _centimetres(metres: float) -> int:
    return min(max(round(metres * 100.0), 0), MAX_CENTIMETRES) if isfinite(metres) else 0
