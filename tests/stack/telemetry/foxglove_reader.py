"""Reads Foxglove's messages with other software: the MCAP reader, and Google's protobuf."""

import json
from functools import cache

import numpy as np
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from mcap.reader import make_reader


@cache
def message_class(name, descriptors):
    """The class of a schema, from nothing but what the file or the server says of it."""
    pool = descriptor_pool.DescriptorPool()
    for file in descriptor_pb2.FileDescriptorSet.FromString(descriptors).file:
        pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(name))


def read(path):
    """All messages of a file by topic, in order of time: (log time in seconds, message)."""
    found = {}
    with path.open("rb") as file:
        for schema, channel, message in make_reader(file, validate_crcs=True).iter_messages():
            if channel.message_encoding == "json":
                content = json.loads(message.data, parse_constant=pytest_fail)
            else:
                content = message_class(schema.name, schema.data).FromString(message.data)
            found.setdefault(channel.topic, []).append((message.log_time / 1e9, content))
    return found


def pytest_fail(constant):
    raise AssertionError(f"{constant} is not JSON")


def seconds(stamp):
    """A protobuf timestamp in seconds."""
    return stamp.seconds + stamp.nanos / 1e9


def turn(quaternion):
    """The rotation matrix of a quaternion (P. Corke, "Robotics, Vision and Control", 2.2.1.7)."""
    x, y, z, w = quaternion.x, quaternion.y, quaternion.z, quaternion.w
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip


def rigid(position, quaternion):
    """(4, 4) transform of a position and a quaternion."""
    found = np.eye(4)
    found[:3, :3], found[:3, 3] = turn(quaternion), (position.x, position.y, position.z)
    return found


def chain(messages, frame):
    """(4, 4) transform of a frame in the topmost frame, from FrameTransforms messages."""
    parents = {}
    for message in messages:
        for item in message.transforms:
            assert parents.get(item.child_frame_id, item.parent_frame_id) == item.parent_frame_id
            transform = rigid(item.translation, item.rotation)
            parents[item.child_frame_id] = item.parent_frame_id, transform
    found, names = np.eye(4), [frame]
    while names[-1] in parents:
        parent, transform = parents[names[-1]]
        found, names = transform @ found, [*names, parent]
    return found, names


def end_points(message):
    """Ends of the beams in the frame of a foxglove.LaserScan, as its definition says."""
    ranges = np.array(message.ranges)
    angles = np.linspace(message.start_angle, message.end_angle, ranges.size)
    known = np.isfinite(ranges)
    ends = np.column_stack([np.cos(angles), np.sin(angles)])[known] * ranges[known, None]
    pose = rigid(message.pose.position, message.pose.orientation)
    return ends @ pose[:2, :2].T + pose[:2, 3]
