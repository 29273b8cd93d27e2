"""Writes small logs in the formats of other programs."""

from __future__ import annotations

from math import cos, sin

import numpy as np

from stack.types import Pose2D


def flaser(stamp: float, ranges, pose: Pose2D, kind: str = "FLASER") -> str:
    """An old CARMEN message; the laser pose is written as the odometry pose."""
    readings = " ".join(f"{value:.2f}" for value in ranges)
    where = f"{pose.x:.6f} {pose.y:.6f} {pose.heading:.6f}"
    return f"{kind} {len(ranges)} {readings} {where} {where} {stamp:.6f} host {stamp:.6f}\n"


def robotlaser(stamp: float, ranges, robot: Pose2D, mount: Pose2D, *, start: float, spacing: float,
               range_max: float) -> str:  # fmt: skip
    """A new CARMEN message with the geometry of its laser."""
    laser = robot.compose(mount)
    readings = " ".join(f"{value:.3f}" for value in ranges)
    fov = spacing * (len(ranges) - 1)
    poses = " ".join(f"{value:.6f}" for pose in (laser, robot)
                     for value in (pose.x, pose.y, pose.heading))  # fmt: skip
    return (
        f"ROBOTLASER1 0 {start:.6f} {fov:.6f} {spacing:.6f} {range_max:.2f} 0.01 0 {len(ranges)} "
        f"{readings} 0 {poses} 0 0 0 0 0 {stamp:.6f} host {stamp:.6f}\n"
    )


def odom(stamp: float, pose: Pose2D, speed: float = 0.0) -> str:
    """An odometry message."""
    return f"ODOM {pose.x:.6f} {pose.y:.6f} {pose.heading:.6f} {speed} 0 0 {stamp:.6f} h {stamp}\n"


class BagWriter:
    """A rosbag2 in one MCAP or SQLite file, with the messages that robots of ROS 2 publish."""

    def __init__(self, folder, storage="mcap"):
        from rosbags.rosbag2 import StoragePlugin, Writer
        from rosbags.typesys import Stores, get_typestore

        self.store = get_typestore(Stores.ROS2_HUMBLE)
        self.folder = folder
        plugin = StoragePlugin.MCAP if storage == "mcap" else StoragePlugin.SQLITE3
        self.writer = Writer(folder, version=9, storage_plugin=plugin)
        self.writer.open()
        self.connections = {}

    def close(self):
        self.writer.close()

    def write(self, topic, stamp, message):
        """Write a message with a log time of `stamp` seconds."""
        if topic not in self.connections:
            self.connections[topic] = self.writer.add_connection(
                topic, message.__msgtype__, typestore=self.store
            )
        raw = self.store.serialize_cdr(message, message.__msgtype__)
        self.writer.write(self.connections[topic], round(stamp * 1e9), raw)

    def types(self, name):
        """The class of a message."""
        return self.store.types[name]

    def header(self, stamp, frame):
        nanoseconds = round(stamp * 1e9)
        time = self.types("builtin_interfaces/msg/Time")(*divmod(nanoseconds, 10**9))
        return self.types("std_msgs/msg/Header")(time, frame)

    def rotation(self, heading, roll=0.0):
        """A quaternion: roll about x, then heading about z."""
        cr, sr, ch, sh = cos(roll / 2), sin(roll / 2), cos(heading / 2), sin(heading / 2)
        kind = self.types("geometry_msgs/msg/Quaternion")
        return kind(ch * sr, sh * sr, sh * cr, ch * cr)

    def static(self, stamp, parent, child, mount, roll=0.0, topic="/tf_static"):
        """A transform."""
        move = self.types("geometry_msgs/msg/Vector3")(mount.x, mount.y, 0.2)
        transform = self.types("geometry_msgs/msg/Transform")(
            move, self.rotation(mount.heading, roll)
        )
        stamped = self.types("geometry_msgs/msg/TransformStamped")(
            self.header(stamp, parent), child, transform
        )
        self.write(topic, stamp, self.types("tf2_msgs/msg/TFMessage")([stamped]))

    def scan(self, stamp, ranges, frame="laser", topic="/scan", **geometry):
        """A LaserScan of 10 m range over a full turn unless `geometry` says otherwise."""
        kind = self.types("sensor_msgs/msg/LaserScan")
        count = len(ranges)
        values = {
            "angle_min": -np.pi, "angle_max": np.pi, "angle_increment": 2 * np.pi / count,
            "time_increment": 0.0, "scan_time": 0.1, "range_min": 0.1, "range_max": 10.0,
            **geometry,
        }  # fmt: skip
        message = kind(
            self.header(stamp, frame), **values, ranges=np.array(ranges, np.float32),
            intensities=np.zeros(0, np.float32),
        )  # fmt: skip
        self.write(topic, stamp, message)

    def odometry(self, stamp, pose, topic="/odom", base="base_footprint"):
        """An Odometry message."""
        types = self.types
        point = types("geometry_msgs/msg/Point")(pose.x, pose.y, 0.0)
        where = types("geometry_msgs/msg/Pose")(point, self.rotation(pose.heading))
        still = types("geometry_msgs/msg/Vector3")(0.0, 0.0, 0.0)
        twist = types("geometry_msgs/msg/Twist")(still, still)
        message = types("nav_msgs/msg/Odometry")(
            self.header(stamp, "odom"), base,
            types("geometry_msgs/msg/PoseWithCovariance")(where, np.zeros(36)),
            types("geometry_msgs/msg/TwistWithCovariance")(twist, np.zeros(36)),
        )  # fmt: skip
        self.write(topic, stamp, message)

    def imu(self, stamp, rate, frame="imu_link", topic="/imu", up=(0.0, 0.0, 1.0), turning=None):
        """An Imu message: a rate about its z axis or `turning`; `up` is in its own frame."""
        types = self.types
        vector = types("geometry_msgs/msg/Vector3")
        message = types("sensor_msgs/msg/Imu")(
            self.header(stamp, frame), self.rotation(0.0), np.zeros(9),
            vector(*(turning or (0.0, 0.0, rate))), np.zeros(9),
            vector(*(9.81 * part for part in up)), np.zeros(9),
        )  # fmt: skip
        self.write(topic, stamp, message)
