"""snapshots.mcap holds what a dashboard could have shown, and survives what happens to files."""

import json
from contextlib import ExitStack
from dataclasses import replace
from random import Random

import msgpack
import numpy as np
import pytest
import zstandard
from mcap.stream_reader import StreamReader

from stack.errors import InputError
from stack.telemetry.codec import MalformedError
from stack.telemetry.hub import SNAPSHOTS, Telemetry
from stack.telemetry.lost_records import RecordFull
from stack.telemetry.recorder import Recorder, RunFolder
from stack.telemetry.recording_parameters import RecordingParameters
from stack.telemetry.records import Layer, MissionState
from stack.telemetry.snapshots import mcap_file
from stack.telemetry.snapshots.format import BEAMS, SLOW, UNRECORDED, recorded_fields
from stack.telemetry.snapshots.log import SnapshotLog
from stack.telemetry.snapshots.picture_codes import EncodedPicture, decoded_depth, encoded
from stack.telemetry.snapshots.recording import SnapshotRecording
from stack.types import CameraModel, CostGrid, DepthImage, Pose2D
from tests.stack.perception.cameras.pictures import floor_picture
from tests.stack.telemetry.synthetic_run import SyntheticRun

STEP = 0.05


def record(folder, steps, parameters=None, on_step=lambda telemetry, step: None):
    """Record a synthetic run of so many steps; return what was recorded, in order."""
    run, kept = SyntheticRun(), []
    telemetry = Telemetry(
        run.info(),
        [
            Recorder(RunFolder(folder)),
            _Witness(kept, folder / SNAPSHOTS, parameters or RecordingParameters()),
        ],
    )
    for step in range(steps):
        telemetry.advance(step, step * STEP)
        on_step(telemetry, step)
        telemetry.publish(lambda step=step: run.snapshot_at(step * STEP))
    telemetry.close(None)
    return kept


class _Witness(SnapshotLog):
    """Remembers what it was given."""

    def __init__(self, kept, path, parameters):
        super().__init__(path, parameters)
        self._kept = kept

    def snapshot(self, snapshot):
        super().snapshot(snapshot)
        self._kept.append(snapshot)


def equal(ours, theirs):
    """Whether two values are equal, also if they hold arrays."""
    return msgpack.packb(ours) == msgpack.packb(theirs)


def assert_same(replayed, live, *, but=()):
    codecs = recorded_fields()
    for name in codecs.keys() - {"scan", *but}:
        ours, theirs = getattr(replayed, name), getattr(live, name)
        assert equal(codecs[name].encode(ours), codecs[name].encode(theirs)), name
    for name in ("map", "scene"):
        assert replayed.layers[name].version == live.layers[name].version
    assert np.array_equal(replayed.layers["map"].content.cells, live.layers["map"].content.cells)


@pytest.fixture
def opened():
    """Open a run folder; closed at the end of the test."""
    with ExitStack() as stack:
        yield lambda folder: stack.enter_context(SnapshotRecording(folder))


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")

    def tell(telemetry, step):
        if step % 37 == 0:
            telemetry.emit("say", f"step {step}", source="mission", step=step)

    return folder, record(folder, 400, on_step=tell)


def test_a_replay_shows_what_was_live(recorded, opened):
    folder, kept = recorded
    recording = opened(folder)
    assert recording.is_complete
    assert recording.info == replace(SyntheticRun().info(), identity=recording.info.identity,
                                     footprint=recording.info.footprint)  # fmt: skip
    # 20 s at 5 Hz, and after each of 11 events; those of step 0, 148 and 296 are due anyway
    assert len(recording.times) == len(kept) == 100 + 8
    for number in Random(3).sample(range(len(kept)), 20):
        at = recording.index_at(kept[number].time)
        assert recording.times[at] == pytest.approx(kept[number].time)
        assert_same(recording.snapshot(number), kept[number], but=SLOW)


def test_large_and_slow_fields_are_at_most_a_second_old(recorded, opened):
    folder, kept = recorded
    recording = opened(folder)
    for number, live in enumerate(kept):
        particles = recording.snapshot(number).particles
        before = [one for one in kept[: number + 1] if one.time >= live.time - 1.0 - STEP]
        assert any(np.array_equal(particles, one.particles) for one in before)


def test_a_scan_keeps_its_shape_and_place(recorded, opened):
    folder, kept = recorded
    replayed = opened(folder).snapshot(50).scan
    live = kept[50].scan
    assert replayed.ranges.size <= BEAMS
    ends = live.points()
    for point in replayed.points():
        assert np.hypot(*(ends - point).T).min() < 1e-5


def test_a_replay_knows_the_events(recorded, opened):
    folder, kept = recorded
    recording = opened(folder)
    last = recording.snapshot(len(kept) - 1)
    assert [event.fields["step"] for event in last.events] == list(range(0, 400, 37))
    assert recording.events(2, 4)[0].fields["step"] == 74
    half = recording.snapshot(recording.index_at(10.0))  # steps 0 to 200
    assert len(half.events) == 6


def test_pictures_are_recorded_once_a_second_with_their_camera(tmp_path, opened):
    run = SyntheticRun()
    log = SnapshotLog(tmp_path / SNAPSHOTS, RecordingParameters())
    log.open(run.info())
    live = []
    for n in range(30):  # 6 s at 5 Hz, a new picture in each; the camera is turned at 3 s
        taken = run.image_from(Pose2D(1.0, 1.0, 0.1 * n), 0.2 * n)
        taken = replace(taken, camera=replace(taken.camera, yaw=0.5 * (n >= 15)))
        live.append(replace(
            run.snapshot_at(0.2 * n), image=taken, depth_image=floor_picture(0.2 * n, n)
        ))  # fmt: skip
        log.snapshot(live[-1])
    log.close(None)
    recording = opened(tmp_path)
    for number in Random(4).sample(range(30), 12):
        shown, then = recording.snapshot(number), live[5 * (number // 5)]
        assert shown.image.stamp == shown.depth_image.stamp == then.time
        assert shown.image.camera == then.image.camera
        error = shown.image.pixels.astype(float) - then.image.pixels
        assert np.abs(error).mean() < 3.0  # JPEG of quality 80
        assert np.allclose(shown.depth_image.depth, then.depth_image.depth, atol=6e-4,
                           equal_nan=True)  # fmt: skip
        assert shown.depth_image.range_max == then.depth_image.range_max
    assert recording.snapshot(3, whole=False).image is None
    with (tmp_path / SNAPSHOTS).open("rb") as file:
        records = list(StreamReader(file).records)
    names = {one.id: one.topic for one in records if type(one).__name__ == "Channel"}
    topics = [names[one.channel_id] for one in records if type(one).__name__ == "Message"]
    assert topics.count("/pictures/camera") == topics.count("/pictures/depth") == 6
    assert (topics.count("/cameras/camera"), topics.count("/cameras/depth")) == (2, 1)


def test_a_depth_picture_keeps_what_is_invalid_and_what_has_no_return():
    depth = np.array([[np.nan, np.inf, 0.3], [1.2345, 64.9, 70.0]], np.float32)
    camera = CameraModel(3, 2, 2.0, (0.0, 0.0, 0.0))
    image = DepthImage(1.0, depth, camera, 0.1, 80.0)
    found = decoded_depth(encoded(image), camera)
    # millimetres in 16 bits; what is farther than 65 m is 65 m
    wanted = [[np.nan, np.inf, 0.3], [1.234, 64.9, 65.0]]
    assert np.allclose(found.depth, wanted, atol=6e-4, equal_nan=True)
    with pytest.raises(MalformedError):
        decoded_depth(encoded(image), replace(camera, width=4))
    with pytest.raises(MalformedError):
        decoded_depth(EncodedPicture(1.0, b"no picture"), camera)


def test_every_field_has_a_place():
    assert not recorded_fields().keys() & UNRECORDED
    assert set(SLOW) <= recorded_fields().keys()


def test_a_run_is_followed_while_it_is_written(tmp_path, opened):
    recordings, seen = [], []

    def look(telemetry, step):
        if step == 20:
            recordings.append(opened(tmp_path))
        if step > 20 and step % 10 == 0:
            assert recordings[0].follow() > 0
            seen.append(recordings[0].snapshot(len(recordings[0].times) - 1).time)

    record(tmp_path, 100, on_step=look)
    assert seen == pytest.approx([(step - 10 + 8) * STEP for step in range(30, 100, 10)], abs=0.2)
    recordings[0].follow()
    assert recordings[0].is_complete


def test_a_killed_run_is_readable_up_to_its_last_message(recorded, tmp_path, opened):
    folder, kept = recorded
    content = (folder / SNAPSHOTS).read_bytes()
    begin = len(content) // 10
    for end in Random(5).sample(range(begin, len(content)), 20):
        (tmp_path / SNAPSHOTS).write_bytes(content[:end])
        recording = opened(tmp_path)
        number = len(recording.times) - 1
        assert not recording.is_complete
        assert_same(recording.snapshot(number), kept[number], but=SLOW)


def test_damage_is_an_error_that_names_the_file(recorded, tmp_path):
    content = bytearray((recorded[0] / SNAPSHOTS).read_bytes())
    random, refused = Random(7), 0
    for _ in range(400):
        damaged = bytearray(content)
        for _ in range(random.randint(1, 4)):
            damaged[random.randrange(len(damaged))] = random.randrange(256)
        (tmp_path / SNAPSHOTS).write_bytes(damaged)
        try:
            with SnapshotRecording(tmp_path) as recording:
                for number in range(0, len(recording.times), 7):
                    recording.snapshot(number)
        except InputError as error:
            assert SNAPSHOTS in str(error)
            refused += 1
    assert refused > 50


@pytest.mark.parametrize("content", [b"", b"x", b"\x89MCAP0\r\n", b"\x89MCAP0\r\n" + b"\0" * 40])
def test_no_recording_is_an_error(content, tmp_path):
    (tmp_path / SNAPSHOTS).write_bytes(content)
    with pytest.raises(InputError, match=SNAPSHOTS):
        SnapshotRecording(tmp_path)


def test_a_folder_without_snapshots_is_an_error(tmp_path):
    with pytest.raises(InputError, match="no snapshots that can be replayed"):
        SnapshotRecording(tmp_path)


def test_other_programs_can_read_it(recorded):
    topics = set()
    with (recorded[0] / SNAPSHOTS).open("rb") as file:
        for item in StreamReader(file).records:
            if type(item).__name__ == "Channel":
                topics.add(item.topic)
            elif type(item).__name__ == "Message":
                fields = msgpack.unpackb(zstandard.ZstdDecompressor().decompress(item.data))
                assert isinstance(fields, dict)
            elif type(item).__name__ == "Schema":
                assert json.loads(item.data)
    assert topics >= {"/run", "/keyframes", "/changes", "/layers/map", "/layers/scene"}


def _with_schema(tmp_path, monkeypatch, opened, change):
    original = mcap_file.schemas
    monkeypatch.setattr(mcap_file, "schemas", lambda: change(original()))
    record(tmp_path, 30)
    monkeypatch.setattr(mcap_file, "schemas", original)
    return opened(tmp_path)


def test_a_field_of_another_version_is_left_out(tmp_path, monkeypatch, opened):
    def renamed(found):
        found["Snapshot"]["battery_of_the_future"] = "str"
        found["Snapshot"]["safety"] = "int"
        return found

    recording = _with_schema(tmp_path, monkeypatch, opened, renamed)
    assert recording.snapshot(3).safety == ""
    assert recording.snapshot(3).pose != Pose2D(0.0, 0.0)


def test_a_pose_of_another_version_is_refused(tmp_path, monkeypatch, opened):
    def changed(found):
        found["Snapshot"]["pose"] = "Pose3D(x:float)"
        return found

    with pytest.raises(InputError, match=r"whose pose of a Snapshot .* open it with that version"):
        _with_schema(tmp_path, monkeypatch, opened, changed)


def test_it_stops_at_its_limit(tmp_path, opened):
    warned = []
    run = SyntheticRun()
    log = SnapshotLog(tmp_path / SNAPSHOTS, RecordingParameters(size_limit=1.0))
    telemetry = Telemetry(run.info(), [log], warned.append)
    snapshot = run.snapshot_at(0.0)
    for step in range(4000):
        noise = np.random.default_rng(step).integers(0, 100, (500, 500), np.int8)
        grid = replace(run.grid, cells=noise)
        telemetry.advance(step, step * 1.0)
        telemetry.publish(
            lambda step=step, grid=grid: replace(
                snapshot, time=float(step), layers={"map": Layer(step, grid)}
            )
        )
        if warned:
            break
    telemetry.close(None)
    size = (tmp_path / SNAPSHOTS).stat().st_size
    assert 0.5e6 < size <= 1e6
    assert warned == [f"! at {step:.1f} s {RecordFull(SNAPSHOTS, 1e6)}"]
    assert opened(tmp_path).snapshot(0).layers["map"].content.cells.shape == (500, 500)


def test_changed_parts_of_a_costmap_add_up(tmp_path, opened):
    """A costmap is written in parts; each version read is the one that was there."""
    random, cells, boxes, live = np.random.default_rng(1), np.zeros((90, 70), np.uint8), [], []
    run, log = SyntheticRun(), SnapshotLog(tmp_path / SNAPSHOTS, RecordingParameters(rate=10.0))
    telemetry = Telemetry(run.info(), [log])
    for step in range(200):
        top, left = random.integers(0, 80), random.integers(0, 60)
        cells = cells.copy()
        cells[top : top + 10, left : left + 10] = random.integers(0, 255)
        boxes.append((step + 1, (int(top), int(top) + 10, int(left), int(left) + 10)))
        layer = Layer(step + 1, CostGrid(cells, 0.1), tuple(boxes[-50:]))
        snapshot = replace(
            run.snapshot_at(step * 0.1), state=MissionState.RUNNING,
            layers={"global_costmap": layer},
        )  # fmt: skip
        live.append(layer)
        telemetry.advance(step, step * 0.1)
        telemetry.publish(lambda snapshot=snapshot: snapshot)
    telemetry.close(None)
    recording = opened(tmp_path)
    for number in Random(2).sample(range(200), 40):  # forwards and backwards
        found = recording.snapshot(number).layers["global_costmap"]
        assert 0 <= number + 1 - found.version <= 20  # at most two seconds old
        assert np.array_equal(found.content.cells, live[found.version - 1].content.cells)
