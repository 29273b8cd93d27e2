"""Damaged and hostile recordings: refused with a sentence, in bounded memory."""

import random
import struct
from dataclasses import replace

import numpy as np
import pytest

from stack.errors import InputError
from stack.telemetry.sensor_log import SensorLog, read_about, read_observations
from stack.types import Battery, Imu, Observation, Odometry, Pose2D, RangeReading, Scan, Twist

MAGIC = b"\x89MCAP0\r\n"
CHUNK, HEADER, METADATA, MESSAGE = 0x06, 0x01, 0x0C, 0x05
MOUNT = Pose2D(0.0, 0.0)


@pytest.fixture
def log(tmp_path):
    """Ten observations of several sensors."""
    path = tmp_path / "sensors.mcap"
    writer = SensorLog(path, {"robot": "scout", "seed": "1"})
    ranges = np.linspace(1.0, 2.0, 8, dtype=np.float32)
    for step in range(10):
        time = step * 0.05
        found = {
            "lidar": Scan(time, ranges, 0.0, 0.1, 0.1, 10.0, MOUNT),
            "wheels": Odometry(time, MOUNT, Twist(0.1, 0.0)),
            "sonar": RangeReading(time, 1.0, 0.1, 2.0, 0.5, MOUNT, "base"),
            "imu": Imu(np.array([time]), np.zeros((1, 3)), np.zeros((1, 3))),
            "battery": Battery(0.5, stamp=time),
        }
        writer.write(Observation(time, found))
    writer.close()
    return path


def record(kind, content):
    return struct.pack("<BQ", kind, len(content)) + content


def chunk(compression, content, size):
    name = compression.encode()
    head = struct.pack("<QQQII", 0, 1, size, 0, len(name)) + name
    return record(CHUNK, head + struct.pack("<Q", len(content)) + content)


HEAD = MAGIC + record(HEADER, struct.pack("<II", 0, 0))


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (HEAD + struct.pack("<BQ", MESSAGE, 1 << 60), "1152921504606846976"),
        (HEAD + struct.pack("<BQ", 0x7F, 1 << 40), "1099511627776"),  # of an unknown kind
        (HEAD + record(METADATA, struct.pack("<I", 0xFFFFFFFF)), "a record of 4294967295 bytes"),
        (HEAD + chunk("zstd", b"nonsense", 8), "a damaged chunk"),
        (HEAD + chunk("lz4", b"nonsense", 8), "a damaged chunk"),
        (b"root:x:0:0:root:/root:/bin/bash\n", "it is not an MCAP file"),
    ],
)
def test_lengths_and_chunks_that_cannot_be_are_refused(tmp_path, content, sentence):
    path = tmp_path / "sensors.mcap"
    path.write_bytes(content)
    for read in (read_about, lambda path: list(read_observations(path))):
        with pytest.raises(InputError, match=sentence) as refused:
            read(path)
        assert "root" not in str(refused.value).replace(str(path), "")


@pytest.mark.parametrize("compression", ["zstd", "lz4"])
def test_a_decompression_bomb_is_refused(tmp_path, compression):
    """70 MB of zeros are a few kB when compressed with zstd."""
    import lz4.frame
    import zstandard

    compress = {"zstd": zstandard.compress, "lz4": lz4.frame.compress}[compression]
    path = tmp_path / "sensors.mcap"
    path.write_bytes(HEAD + chunk(compression, compress(bytes(70_000_000)), 100))
    with pytest.raises(InputError, match="a chunk of more than 67108864 bytes"):
        list(read_observations(path))


@pytest.mark.parametrize("compression", ["", "zstd", "lz4"])
def test_a_log_in_chunks_is_read(log, compression):
    """As `mcap filter` writes it."""
    import lz4.frame
    import zstandard

    whole = list(read_observations(log))
    content = log.read_bytes()
    begin = 8 + 9 + struct.unpack("<Q", content[9:17])[0]  # after magic and header
    metadata = begin + 9 + struct.unpack("<Q", content[begin + 1 : begin + 9])[0]
    end, kinds = metadata, (0x03, 0x04, MESSAGE)  # schemas, channels, messages
    while content[end] in kinds:
        end += 9 + struct.unpack("<Q", content[end + 1 : end + 9])[0]
    compress = {"": bytes, "zstd": zstandard.compress, "lz4": lz4.frame.compress}[compression]
    inner = content[metadata:end]
    parts = content[:metadata], chunk(compression, compress(inner), len(inner)), content[end:]
    log.write_bytes(b"".join(parts))
    again = list(read_observations(log))
    assert [item.time for item in again] == [item.time for item in whole]
    assert len(again) == 10
    assert again[3].measurements.keys() == whole[3].measurements.keys()


def test_values_of_another_type_are_refused(log):
    content = log.read_bytes()
    text = content.replace(b"\xa5stamp\xcb", b"\xa5stamp\xa8")  # a float becomes 8 characters
    assert text != content
    log.write_bytes(text)
    with pytest.raises(InputError, match="is damaged: "):
        list(read_observations(log))


def test_damage_anywhere_is_refused_or_harmless(log):
    """Wrong bytes and cuts: an InputError, or observations of the right types."""
    content, chance = log.read_bytes(), random.Random(7)
    refused = 0
    for _ in range(200):
        damaged = bytearray(content)
        for _ in range(chance.randrange(1, 4)):
            damaged[chance.randrange(len(damaged))] = chance.randrange(256)
        log.write_bytes(damaged[: chance.randrange(len(damaged))])
        try:
            for observation in read_observations(log):
                for measurement in observation.measurements.values():
                    assert isinstance(replace(measurement).stamp, float)
        except InputError:
            refused += 1
    assert refused > 20
