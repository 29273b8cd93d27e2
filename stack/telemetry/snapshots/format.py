"""Format of snapshots.mcap: topics, types of their messages, and layout of a message in the file.

The file is an MCAP file without chunks, so that a killed run can be read up to its last complete
message. Each message is msgpack, compressed with zstd on its own:

    /run              once: the fields of RunInfo by name
    /keyframes        each KEYFRAME_PERIOD: all recorded fields of a Snapshot by name
    /changes          between them: the fields that differ from the snapshot before
    /layers/NAME      a layer, when it changed: before the first snapshot that refers to it
    /pictures/NAME    a new picture, at most one in PICTURE_PERIOD: before the snapshot that has it
    /cameras/NAME     the camera of the following pictures of this name, when it changed

`log_time` is the robot's clock in nanoseconds. A value is encoded as on the wire (codec.py); the
schema of a topic tells the type of each field, so that a reader of another version finds the fields
that still mean the same. docs/runs.md describes the format for other programs.
"""

from __future__ import annotations

import struct

from stack.telemetry.codec import Codec, codec_of, field_codecs
from stack.telemetry.records import Layer, RunInfo, Snapshot, TreeRow
from stack.telemetry.snapshots.picture_codes import EncodedPicture
from stack.types import CameraModel

FORMAT = "1"
"""Version of the format; increase it for changes that the schemas do not show."""

NANOSECONDS = 1e9

KEYFRAME_PERIOD = 5.0
"""Robot time between two keyframes, s: a reader decodes at most this much for one snapshot."""

SLOW_PERIOD = 1.0
"""Robot time between two records of what is large and changes little, s."""

SLOW = ("particles", "stages", "parameters", "depth_points", "counters", "sensors", "memory")

LAYER_PERIODS = {"local_costmap": 1.0, "global_costmap": 2.0}
"""Robot time between two records of a costmap, s. Other layers are recorded at each change."""

BEAMS = 360
"""Beams of a recorded scan at most: it is for displays, sensors.mcap has all of them."""

UNRECORDED = frozenset({"image", "depth_image", "layers", "events"})
"""Fields of a Snapshot that have other places: topics of their own, events.jsonl."""

PICTURES = {"camera": "image", "depth": "depth_image"}
"""Name of a picture in topics -> field of a Snapshot."""

PICTURE_PERIOD = 1.0
"""Least robot time between two records of a picture of one name, s."""

ROWS, LAYERS, EVENTS = "tree_rows", "layers", "events"
"""Besides the fields of a Snapshot: the changed rows of the tree as (index, row), the names of its
layers, and the number of events before it."""

PATCH, MAX_PATCHES = "patch", 20
"""A layer with the same frame as before may come as [top, left, rows, columns, bytes of cells]."""

FREQUENT = frozenset({"pose", "teleop"})
"""Kinds of events after which no snapshot is due."""

MAGIC = b"\x89MCAP0\r\n"
"""First and last bytes of an MCAP file."""

MESSAGE = struct.Struct("<BQHIQQ")
"""Kind and length of an MCAP record, then channel, sequence and two times of a message."""

MESSAGE_KIND, TIMES = 5, 22
"""Kind of a message; bytes of its fields before the data."""


ROWS_TYPE = tuple[tuple[int, TreeRow], ...]


def recorded_fields() -> dict[str, Codec]:
    """The codec of each field of a snapshot that is recorded as such, by name."""
    return {name: codec for name, codec in field_codecs(Snapshot).items() if name not in UNRECORDED}


def schemas() -> dict[str, dict[str, str]]:
    """The types of the fields of each kind of message, as text."""
    codecs = {
        "RunInfo": field_codecs(RunInfo),
        "Snapshot": {**recorded_fields(), ROWS: codec_of(ROWS_TYPE)},
        "Layer": field_codecs(Layer),
        "Picture": field_codecs(EncodedPicture),
        "Camera": field_codecs(CameraModel),
    }
    return {
        kind: {name: codec.shape for name, codec in fields.items()}
        for kind, fields in codecs.items()
    }
