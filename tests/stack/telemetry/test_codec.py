import dataclasses
from math import inf, nan

import msgpack
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from stack.errors import TelemetryError
from stack.telemetry import codec
from stack.telemetry.records import Ack, Command, Event, Layer, RunInfo, Snapshot
from stack.types import CostGrid, Pose2D

quick = settings(deadline=None, max_examples=60)
texts = st.text(max_size=20)
numbers = st.floats(allow_nan=False)
jsonlike = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**63), 2**63 - 1) | numbers | texts,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(texts, inner, max_size=4),
    max_leaves=12,
)
arrays = hnp.arrays(
    st.sampled_from([np.float64, np.float32, np.int8, np.uint8, np.bool_]),
    hnp.array_shapes(min_dims=1, max_dims=3, min_side=0, max_side=70),
)


def same(one, other):
    """Equality that looks into arrays, with NaN equal to itself."""
    if isinstance(one, np.ndarray):
        return one.dtype == other.dtype and np.array_equal(
            one, other, equal_nan=one.dtype.kind == "f"
        )
    if dataclasses.is_dataclass(one):
        names = [field.name for field in dataclasses.fields(one)]
        return type(one) is type(other) and all(
            same(getattr(one, name), getattr(other, name)) for name in names
        )
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    if isinstance(one, tuple):
        return len(one) == len(other) and all(map(same, one, other))
    return type(one) is type(other) and one == other


def there_and_back(record):
    return codec.decode(codec.encode(record), type(record))


def test_a_snapshot_comes_back_whole(snapshot_at):
    snapshot = snapshot_at()
    assert same(there_and_back(snapshot), snapshot)


def test_run_info_comes_back_whole(info):
    assert same(there_and_back(info), info)


@quick
@given(numbers, numbers, st.integers(0, 2**62), texts, st.dictionaries(texts, jsonlike, max_size=5))
def test_events_come_back_whole(time, more, number, text, fields):
    event = Event(number, 3, time, "info", "tree", "kind", text, fields | {"more": more})
    assert same(there_and_back(event), event)


@quick
@given(st.dictionaries(texts, jsonlike, max_size=5))
def test_commands_come_back_whole(arguments):
    command = Command("1", "set_parameter", arguments)
    assert same(there_and_back(command), command)


@quick
@given(arrays)
def test_arrays_come_back_whole(array):
    layer = Layer(3, CostGrid(array, 0.05))
    assert same(there_and_back(layer), layer)


def test_arrays_in_another_order_or_byte_order_come_back_equal():
    grid = np.arange(6000, dtype=">i2").reshape(60, 100).T
    back = there_and_back(Layer(1, CostGrid(grid, 0.05))).content.cells
    assert np.array_equal(back, grid)


def test_a_map_of_one_value_is_compressed():
    cells = np.zeros((400, 400), np.uint8)
    assert len(codec.encode(Layer(1, CostGrid(cells, 0.05)))) < cells.nbytes / 100


def test_numbers_that_json_lacks_survive():
    ack = there_and_back(Command("1", "x", {"inf": inf, "nan": nan}))
    assert ack.arguments["inf"] == inf and ack.arguments["nan"] != ack.arguments["nan"]


def test_numpy_numbers_become_plain_ones():
    back = there_and_back(Command("1", "x", {"n": np.float32(0.5), "l": (1, np.int64(2))}))
    assert back.arguments == {"n": 0.5, "l": [1, 2]} and type(back.arguments["n"]) is float


def test_values_without_encoding_are_refused_by_type():
    with pytest.raises(TelemetryError, match="Command cannot be sent: object is neither"):
        codec.encode(Command("1", "x", {"thing": object()}))


@quick
@given(st.binary(max_size=200))
def test_random_bytes_are_refused(noise):
    with pytest.raises(TelemetryError):
        codec.decode(noise, Snapshot)


@quick
@given(st.data())
def test_a_damaged_message_is_refused_or_decoded_without_other_errors(data):
    whole = codec.encode(Event(1, 2, 3.0, "info", "tree", "kind", "text", {"a": [1, 2.0]}))
    at = data.draw(st.integers(0, len(whole) - 1))
    damaged = whole[:at] + bytes([data.draw(st.integers(0, 255))]) + whole[at + 1 :]
    try:
        assert isinstance(codec.decode(damaged, Event), Event)
    except TelemetryError:
        pass


@quick
@given(jsonlike)
def test_wrong_fields_are_refused(fields):
    for kind in (Snapshot, RunInfo, Event, Layer):
        with pytest.raises(TelemetryError, match="malformed"):
            codec.decode(msgpack.packb([codec.stamp(), kind.__name__, fields]), kind)


def test_another_version_is_refused_with_both_versions():
    foreign = msgpack.packb(["0.cafe", "Ack", ["1", True, ""]])
    with pytest.raises(TelemetryError, match=r"version '0.cafe', this side '2\.[0-9a-f]{8}'"):
        codec.decode(foreign, Ack)


def test_the_wrong_record_is_refused():
    with pytest.raises(TelemetryError, match="expected a Snapshot, got 'Ack'"):
        codec.decode(codec.encode(Ack("1", True)), Snapshot)


@pytest.mark.parametrize(
    "array",
    [
        ["<f8", [1 << 40], False, b""],  # asks for 8 TB
        ["|u1", [4], True, b"\x00"],  # not a zlib stream
        ["|u1", [2], False, b"abc"],  # a byte too many
        ["|O", [1], False, b"12345678"],  # objects
        ["<f8", [-1], False, b""],
        ["<f8", "1", False, b"12345678"],
        [[], [1], False, b"12345678"],
    ],
)
def test_impossible_arrays_are_refused(array):
    message = [codec.stamp(), "Layer", [1, [1, [array, 0.05, [0.0, 0.0]]]]]
    with pytest.raises(TelemetryError, match="malformed Layer"):
        codec.decode(msgpack.packb(message), Layer)


def test_a_zip_bomb_is_refused():
    import zlib

    bomb = zlib.compress(bytes(50_000_000), 9)
    message = [codec.stamp(), "Layer", [1, [1, [["|u1", [10], True, bomb], 0.05, [0.0, 0.0]]]]]
    with pytest.raises(TelemetryError, match="needs 10 bytes, got 11"):
        codec.decode(msgpack.packb(message), Layer)


def test_a_pose_of_whole_numbers_arrives_as_floats():
    command = there_and_back(Layer(1, CostGrid(np.zeros((1, 1), np.uint8), 1)))
    assert type(command.content.resolution) is float
    assert Pose2D(1, 2) == Pose2D(1.0, 2.0)


def test_the_changes_of_a_layer_stay_in_the_engine():
    layer = Layer(3, CostGrid(np.zeros((2, 2), np.uint8), 0.05), ((3, (0, 1, 0, 1)),))
    received = codec.decode(codec.encode(layer), Layer)
    assert received.version == 3 and received.changes == ()
